// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/alignment_summary.hpp"

#include "report/alignment_words.hpp"
#include "report/json_text.hpp"
#include "symrig/report/text.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace symrig {

using report::Json;

namespace {

Json goals_json(const std::vector<AlignmentFinding>& findings) {
  Json goals = Json::array();
  for (const AlignmentFinding& f : findings)
    goals.push_back({{"name", report::name_of(f.goal)},
                     {"value", f.value},
                     {"wanted", f.wanted},
                     {"good", f.good},
                     {"cell_factor", f.cell_factor}});
  return goals;
}

Json focus_json(const Alignment& a) {
  Json focus = Json::array();
  for (const TileFocus& tile : a.focus) focus.push_back(tile.known ? Json(tile.blur) : Json());
  return focus;
}

/// "cells of 13 projector pixels", or "cells 1.3 times as large".
std::string cells_of(double factor, int cell) {
  if (cell > 0) return fmt::format("cells of {} projector pixels", std::ceil(cell * factor - 1e-9));
  return fmt::format("cells {:.2f} times as large", factor);
}

/// What the rig would do as it stands.
std::string verdict(const AlignmentUpdate& update) {
  const double factor = cell_factor(update.findings);
  if (all_good(update.findings))
    return factor > 0 ? fmt::format("good enough; {} would be, too", cells_of(factor, update.cell))
                      : std::string("good enough");
  if (factor > 1)
    return fmt::format("not good enough; as the rig stands, it is for {}", cells_of(factor, update.cell));
  return "not good enough yet";
}

/// The perspective map in words.
std::string map_text(const Alignment& a) {
  const MapShape& s = a.shape;
  return fmt::format(
      "turned by {:.2f}° {}{}; keystone {:+.1f} % along rows, {:+.1f} % along columns; lens {:+.1f} %; {} "
      "dark",
      std::abs(s.turn), s.turn < 0 ? "counter-clockwise" : "clockwise", s.mirrored ? ", mirrored" : "",
      100 * s.keystone_cols, 100 * s.keystone_rows, 100 * s.distortion, text::percent(a.dark));
}

/// The finding of the same goal.
const AlignmentFinding* same_goal(const AlignmentUpdate* update, AlignmentGoal goal) {
  if (update == nullptr) return nullptr;
  const auto found = std::ranges::find(update->findings, goal, &AlignmentFinding::goal);
  return found == update->findings.end() ? nullptr : &*found;
}

}  // namespace

std::string missed_goals(const std::vector<AlignmentFinding>& findings) {
  std::string names;
  for (const AlignmentFinding& f : findings)
    if (!f.good) names += (names.empty() ? "" : ", ") + std::string(report::name_of(f.goal));
  return names;
}

std::string alignment_json(const AlignmentUpdate& update) {
  const Alignment& a = update.alignment;
  const MapShape& s = a.shape;
  Json json;
  json["command"] = "align";
  json["rig"] = update.rig;
  json["update"] = update.count;
  json["seconds"] = update.seconds;
  json["good"] = all_good(update.findings);
  json["cell_factor"] = cell_factor(update.findings);
  json["cells"] = report::grid_json(a.cells);
  json["camera_grid"] = report::grid_json(a.camera);
  json["photographs"] = a.photographs;
  json["seen"] = a.seen;
  json["goals"] = goals_json(update.findings);
  if (a.glimpse) json["glimpse"] = {a.glimpse->row, a.glimpse->col};
  if (a.seen) {
    json["shift"] = {s.shift.row, s.shift.col};
    json["turn"] = s.turn;
    json["mirrored"] = s.mirrored;
    json["pixels_per_cell"] = s.pixels_per_cell;
    json["keystone"] = {s.keystone_rows, s.keystone_cols};
    json["distortion"] = s.distortion;
    json["parallax"] = {{"range", s.parallax.range},
                        {"direction", {s.parallax.direction.row, s.parallax.direction.col}},
                        {"along", s.parallax.along},
                        {"across", s.parallax.across}};
    json["offset"] = a.offset;
    json["cells_seen"] = a.cells_seen;
    json["blur"] = a.blur();
    json["focus"] = focus_json(a);
    json["saturated"] = a.saturated;
    json["dark"] = a.dark;
    json["signal_to_noise"] = a.signal_to_noise;
    json["edges"] = a.edges;
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string alignment_line(const AlignmentUpdate& update) {
  std::string line = fmt::format("update {}:", update.count);
  for (const AlignmentFinding& f : update.findings) {
    if (f.goal == AlignmentGoal::stripes && f.good) continue;
    line += fmt::format(" {} {}{},", report::name_of(f.goal), report::value_text(f), f.good ? "" : " (!)");
  }
  line.back() = ';';
  return line + " " + verdict(update) + "\n";
}

std::string alignment_page(const AlignmentUpdate& update, const AlignmentUpdate* before) {
  const double rate = update.seconds > 0 ? static_cast<double>(update.count) / update.seconds : 0;
  std::string page =
      fmt::format("symrig align {}\nupdate {}, {:.1f} a second\n\n", update.rig, update.count, rate);
  page += fmt::format("{:16} {:>9} {:>9} {:>11}\n", "", "now", "before", "goal");
  for (const AlignmentFinding& f : update.findings) {
    const AlignmentFinding* was = same_goal(before, f.goal);
    page += fmt::format("{:16} {:>9} {:>9} {:>11}  {}\n", report::name_of(f.goal), report::value_text(f),
                        was == nullptr ? "" : report::value_text(*was), report::wanted_text(f),
                        f.good ? "good" : "not yet");
    if (!f.good) page += fmt::format("    {}\n", advice(f, update.alignment));
  }
  if (update.alignment.seen) page += "\n" + map_text(update.alignment) + "\n";
  return page + verdict(update) + "\n";
}

}  // namespace symrig
