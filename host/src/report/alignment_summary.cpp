// SPDX-License-Identifier: Apache-2.0

#include "symrig/calibration/alignment.hpp"
#include "symrig/report/calibration_summary.hpp"
#include "symrig/report/internal/json_text.hpp"
#include "symrig/report/text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include <fmt/format.h>

namespace symrig {

namespace {

/// Names of the 3 × 3 parts of a picture.
constexpr std::array<const char*, 9> kParts{"upper left", "top",        "upper right", "left",       "middle",
                                            "right",      "lower left", "bottom",      "lower right"};

/// "7.3 cells up and 4.1 cells left": where to aim a camera that looks this far beside.
std::string aim(const Point& shift) {
  constexpr double kLeast = 0.005;  // [cells]
  std::string text;
  if (std::abs(shift.row) > kLeast)
    text = fmt::format("{:.2g} cells {}", std::abs(shift.row), shift.row > 0 ? "up" : "down");
  if (std::abs(shift.col) > kLeast)
    text += fmt::format("{}{:.2g} cells {}", text.empty() ? "" : " and ", std::abs(shift.col),
                        shift.col > 0 ? "left" : "right");
  return text.empty() ? "at the middle" : text;
}

/// A camera whose picture is smaller than the cells must see more; another one must only look elsewhere.
std::string see_all(const Alignment& a) {
  const double pixels = a.shape.pixels_per_cell;
  const double missing =
      std::max(a.cells.rows * pixels / a.camera.rows, a.cells.cols * pixels / a.camera.cols);
  std::string where = "aim the camera " + aim(a.shape.shift);
  if (missing <= 1) return where;
  return fmt::format("zoom out {:.2f} times or move the camera back, and {}", missing, where);
}

/// The part of the offset that moves the corner of the picture most.
std::string sit_on_cells(const Alignment& a) {
  const MapShape& s = a.shape;
  const double corner = 0.5 * std::hypot(a.cells.rows, a.cells.cols);
  const double turn = corner * std::abs(s.turn) * std::numbers::pi / 180,
               zoom = corner * std::abs(s.pixels_per_cell - 1);
  const double shift = std::hypot(s.shift.row, s.shift.col);
  if (s.mirrored) return "the picture is mirrored: mirror it in camera or projector";
  if (turn >= std::max(zoom, shift))
    return fmt::format("turn the camera by {:.2g}° {}", std::abs(s.turn),
                       s.turn > 0 ? "counter-clockwise" : "clockwise");
  if (zoom >= shift)
    return fmt::format("zoom {} by {:.2g} %", s.pixels_per_cell > 1 ? "out" : "in",
                       100 * std::abs(s.pixels_per_cell - 1));
  return "aim the camera " + aim(s.shift);
}

std::string focus_at(const Alignment& a) {
  const auto* const worst = std::ranges::max_element(a.focus, {}, &TileFocus::blur);
  return fmt::format("focus projector and camera; worst at the {} of the picture",
                     kParts[static_cast<std::size_t>(worst - a.focus.begin())]);
}

/// "up or down", by the larger component.
std::string move_along(const Point& direction) {
  const double rows = std::abs(direction.row), cols = std::abs(direction.col);
  if (rows > 2 * cols) return "up or down";
  if (cols > 2 * rows) return "left or right";
  return direction.row * direction.col > 0 ? "to the lower right or upper left"
                                           : "to the upper right or lower left";
}

// Names and numbers of the goals of an alignment.

/// "focus"; the key in JSON, too.
std::string goal_name(AlignmentGoal goal) {
  switch (goal) {
    case AlignmentGoal::stripes:
      return "stripes";
    case AlignmentGoal::cells:
      return "cells seen";
    case AlignmentGoal::pixels:
      return "pixels a cell";
    case AlignmentGoal::offset:
      return "offset";
    case AlignmentGoal::focus:
      return "blur";
    case AlignmentGoal::parallax:
      return "parallax";
    case AlignmentGoal::saturated:
      return "saturated";
    case AlignmentGoal::light:
      return "light";
  }
  return {};
}

std::string value_of_goal(AlignmentGoal goal, double value) {
  switch (goal) {
    case AlignmentGoal::stripes:
      return value > 0 ? "yes" : "no";
    // Never "100 %" for nearly all cells.
    case AlignmentGoal::cells:
      return fmt::format("{:.2f} %", std::floor(1e4 * value) / 100);
    case AlignmentGoal::saturated:
      return text::percent(value);
    case AlignmentGoal::light:
      return fmt::format("{:.0f}", std::min(value, 1e6));
    default:
      return fmt::format("{:.3f}", value);
  }
}

/// "0.31 cells"
std::string goal_value_text(const AlignmentFinding& f) {
  return value_of_goal(f.goal, f.value);
}

/// "≤ 0.10"
std::string goal_wanted_text(const AlignmentFinding& f) {
  switch (f.goal) {
    case AlignmentGoal::stripes:
      return "";
    case AlignmentGoal::cells:
    case AlignmentGoal::pixels:
    case AlignmentGoal::light:
      return ">= " + value_of_goal(f.goal, f.wanted);
    default:
      return "<= " + value_of_goal(f.goal, f.wanted);
  }
}

}  // namespace

std::string advice(const AlignmentFinding& finding, const Alignment& a) {
  switch (finding.goal) {
    case AlignmentGoal::stripes:
      return a.glimpse
                 ? "the camera sees too few cells: aim it " + aim(*a.glimpse)
                 : std::string(
                       "the camera sees no stripes: aim it at what the projector lights, and focus both");
    case AlignmentGoal::cells:
      return see_all(a);
    case AlignmentGoal::pixels:
      return "zoom in, move the camera closer, or make the cells larger";
    case AlignmentGoal::offset:
      return sit_on_cells(a);
    case AlignmentGoal::focus:
      return focus_at(a);
    case AlignmentGoal::parallax:
      return fmt::format("move the camera {}, against the arrows of near parts (key r)",
                         move_along(a.shape.parallax.direction));
    case AlignmentGoal::saturated:
      return "expose shorter, or close the camera's iris";
    case AlignmentGoal::light:
      return "expose longer, or open the camera's iris";
  }
  return {};
}

using report::Json;

namespace {

Json goals_json(const std::vector<AlignmentFinding>& findings) {
  Json goals = Json::array();
  for (const AlignmentFinding& f : findings)
    goals.push_back({{"name", goal_name(f.goal)},
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
    if (!f.good) names += (names.empty() ? "" : ", ") + std::string(goal_name(f.goal));
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
    line += fmt::format(" {} {}{},", goal_name(f.goal), goal_value_text(f), f.good ? "" : " (!)");
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
    page += fmt::format("{:16} {:>9} {:>9} {:>11}  {}\n", goal_name(f.goal), goal_value_text(f),
                        was == nullptr ? "" : goal_value_text(*was), goal_wanted_text(f),
                        f.good ? "good" : "not yet");
    if (!f.good) page += fmt::format("    {}\n", advice(f, update.alignment));
  }
  if (update.alignment.seen) page += "\n" + map_text(update.alignment) + "\n";
  return page + verdict(update) + "\n";
}

namespace {

/// To the right, then clockwise.
constexpr std::array<const char*, 8> kArrows{"→", "↘", "↓", "↙", "←", "↖", "↑", "↗"};
constexpr std::array<const char*, 8> kLongArrows{"⇒", "⇘", "⇓", "⇙", "⇐", "⇖", "⇑", "⇗"};
/// Of the longest: shorter ones are a point, and longer ones a double arrow.
constexpr double kPoint = 0.25, kLong = 0.6;

const char* arrow(double row, double col, double longest) {
  const double length = std::hypot(row, col);
  if (length < kPoint * longest) return "·";
  const auto eighth =
      static_cast<std::size_t>(std::lround(std::atan2(row, col) / (std::numbers::pi / 4)) + 8) % 8;
  return length < kLong * longest ? kArrows[eighth] : kLongArrows[eighth];
}

}  // namespace

std::string left_over_picture(const Alignment& alignment, std::size_t columns) {
  const Image<float>& rest = alignment.shape.rest;
  const Grid grid = rest.grid();
  const auto at = [&](int row, int col, int k) { return static_cast<double>(rest.at(row, col, k)); };
  double longest = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      longest = std::max(longest, std::hypot(at(row, col, 0), at(row, col, 1)));
  // A character is twice as high as wide, so each point has a space behind it.
  const std::size_t wide = 2 * static_cast<std::size_t>(grid.cols);
  const int step = static_cast<int>(wide / std::max<std::size_t>(columns, 8)) + 1;
  std::string picture = fmt::format(
      "\nleft over of the map, by part of the camera's picture; the longest is {:.3f} cells\n", longest);
  for (int row = 0; row < grid.rows; row += step) {
    for (int col = 0; col < grid.cols; col += step)
      picture +=
          at(row, col, 2) == 0 ? "  " : std::string(arrow(at(row, col, 0), at(row, col, 1), longest)) + " ";
    picture += "\n";
  }
  return picture;
}

}  // namespace symrig
