// SPDX-License-Identifier: Apache-2.0

#include "report/html.hpp"
#include "report/picture.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/report/calibration_summary.hpp"
#include "symrig/report/internal/json_text.hpp"
#include "symrig/report/text.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {

using report::Json;

std::string registration_json(const RegistrationSummary& summary) {
  const Registration& r = summary.registration;
  Json maps = Json::array();
  for (const CameraMap& map : r.maps)
    maps.push_back({{"error", map.error()},
                    {"edge_width", map.edge_width()},
                    {"edges", map.edges()},
                    {"outlier_share", map.outlier_share()}});
  Json json;
  json["command"] = "calibrate";
  json["source"] = r.rig;
  json["photographs"] = r.photographs;
  json["cells"] = report::grid_json(r.cells);
  json["camera_grid"] = report::grid_json(r.camera());
  json["channels"] = r.flood.mean.channels();
  json["pixels_per_cell"] = r.pixels_per_cell();
  json["maps"] = maps;
  const MapShape& shape = summary.shape;
  json["shape"] = {{"shift", {shape.shift.row, shape.shift.col}},
                   {"turn", shape.turn},
                   {"mirrored", shape.mirrored},
                   {"keystone", {shape.keystone_rows, shape.keystone_cols}},
                   {"distortion", shape.distortion},
                   {"guessed", shape.guessed}};
  json["parallax"] = {{"range", shape.parallax.range},
                      {"direction", {shape.parallax.direction.row, shape.parallax.direction.col}},
                      {"along", shape.parallax.along},
                      {"across", shape.parallax.across},
                      {"coaxial", require_coaxial(shape.parallax).ok()}};
  json["weights"] = {{"kind", to_string(r.weighting())},
                     {"margin", r.margin()},
                     {"cells_seen", summary.weights.valid_cells()},
                     {"cells_by_area", summary.weights.cells_without_core()},
                     {"noise_share", summary.weights.noise_share()}};
  const auto expected = expected_indirect(r, summary.views);
  json["expected_indirect"] =
      expected ? Json{{"surfaces", expected->surfaces}, {"scattering", expected->scattering}} : Json(nullptr);
  json["gain"] = {{"known", r.gain.known}, {"spread", r.gain.spread(r.cells)}, {"sigma", r.gain.sigma},
                  {"veil", r.gain.veil},   {"veil_sigma", r.gain.veil_sigma},  {"pairs", r.gain.pairs}};
  json["blur"] = {{"edges", r.edge_blur()},
                  {"measured", r.blur.measured},
                  {"projector", r.blur.projector},
                  {"camera", r.blur.camera},
                  {"sigma", r.blur.sigma},
                  {"added", std::sqrt(r.blur.missing(summary.weights.pixel_side()))},
                  {"far", r.blur.far}};
  json["reciprocity"] = {{"measured", r.reciprocity.measured},
                         {"corrected", r.reciprocity.corrected},
                         {"left", r.reciprocity.left}};
  json["ghost"] = {{"found", r.ghost.found},
                   {"share", r.ghost.share},
                   {"sigma", r.ghost.sigma},
                   {"place", Json::array({r.ghost.place.row, r.ghost.place.col})},
                   {"significance", r.ghost.significance}};
  json["rig_seconds"] = summary.rig_seconds;
  report::add_made(json, summary.made);
  return report::json_text(json);
}

namespace {

std::string blur_text(const OpticsBlur& blur, const CellWeights& weights) {
  std::string lines = fmt::format(
      "a cell is measured by the area of all pixels that it shares, because the picture is blurred; its "
      "variance is {:.2f} of a pixel's\n"
      "blur of the projector {:.3f} cells rms, of the camera and its pixels {:.3f}; difference ± {:.3f}\n",
      weights.noise_share(), blur.projector, blur.camera, blur.sigma);
  const double missing = blur.missing(weights.pixel_side());
  if (missing > 0)
    return lines + fmt::format("photographs are blurred by {:.3f} cells more, so that both are equal\n",
                               std::sqrt(missing));
  return lines +
         "the camera is blurrier than the projector, which cannot be corrected: focus the camera, or make\n"
         "the cells larger\n";
}

}  // namespace

std::string ghost_text(const CameraGhost& ghost) {
  const auto side = [](double v, const char* positive, const char* negative) {
    return v > 0 ? positive : negative;
  };
  return fmt::format(
      "{} ± {} of the light, {:.1f} cells {} and {:.1f} cells {} of its source; subtracted. To avoid "
      "it, turn the coated side of the plate to the scene, or use a pellicle",
      text::percent(ghost.share), text::percent(ghost.sigma), std::abs(ghost.place.row),
      side(ghost.place.row, "above", "below"), std::abs(ghost.place.col),
      side(ghost.place.col, "left", "right"));
}

std::vector<std::string> registration_warnings(const RegistrationSummary& summary) {
  if (summary.registration.shift) return {};
  const auto coaxial = require_coaxial(summary.shape.parallax);
  if (coaxial) return {};
  return {coaxial.error().line() +
          "; captures with algorithm brute or dual, and maps (-o map.exr), work all the same"};
}

namespace {

std::string shape_text(const MapShape& shape) {
  constexpr double kTold = 0.05;
  std::string lines = fmt::format(
      "the camera is turned by {:.2f}° {}, and its middle looks {:+.2f} rows and {:+.2f} columns beside the "
      "middle of the cells\n"
      "parallax: {:.2f} cells from the nearest to the farthest part of the scene\n",
      std::abs(shape.turn), shape.turn < 0 ? "counter-clockwise" : "clockwise", shape.shift.row,
      shape.shift.col, shape.parallax.range);
  if (shape.guessed > kTold)
    lines += fmt::format("{} of the picture of the cells is dark, or clipped: the map is a guess there\n",
                         text::percent(shape.guessed));
  return lines;
}

std::string map_lines(const Registration& r) {
  using text::grouped, text::percent;
  std::string lines;
  for (std::size_t k = 0; k < r.maps.size(); ++k) {
    const CameraMap& map = r.maps[k];
    const std::string name = r.maps.size() > 1 ? fmt::format("map of channel {}", k) : "map";
    lines +=
        map.edges() == 0
            ? fmt::format("{}: error {:.4f} cells along an axis, from the decoded pixels\n", name,
                          map.error())
            : fmt::format(
                  "{}: error {:.4f} cells along an axis, from {} edges; {} of the edges do not fit "
                  "(depth edges, mirrors)\n",
                  name, map.error(), grouped(static_cast<double>(map.edges())), percent(map.outlier_share()));
  }
  return lines;
}

}  // namespace

std::string registration_text(const RegistrationSummary& summary) {
  using text::grouped, text::percent;
  const Registration& r = summary.registration;
  const CellWeights& weights = summary.weights;
  std::string lines = fmt::format("{}: {} photographs, camera {}, {} cells\n", r.rig, r.photographs,
                                  to_string(r.camera()), to_string(r.cells));
  if (!r.shift) lines += map_lines(r);  // else no edges were looked for: told below
  lines += fmt::format("a cell is {:.2f} camera pixels wide; the camera sees {} of {} cells\n",
                       r.pixels_per_cell(), grouped(static_cast<double>(weights.valid_cells())),
                       grouped(static_cast<double>(r.cells.size())));
  if (!r.shift) lines += shape_text(summary.shape);
  for (const std::string& warning : registration_warnings(summary)) lines += "warning: " + warning + "\n";
  if (r.shift)
    lines += fmt::format(
        "the camera has a pixel for each cell, off by {:+.4f} rows and {:+.4f} columns, each known to "
        "{:.4f}: "
        "corrected; a cell's variance is {:.2f} of a pixel's\n",
        r.shift->row, r.shift->col, r.error(), weights.noise_share());
  else if (r.weighting() == Weighting::cores)
    lines += fmt::format(
        "{}a cell is measured by the pixels that lie at least {:.4f} cells inside it, and gets its part of "
        "what those on its border see beyond that; its variance is {:.2f} of a pixel's\n",
        summary.views.single() ? "the picture is sharp: " : "with several views, blur is not measured: ",
        r.margin(), weights.noise_share());
  else
    lines += blur_text(r.blur, weights);
  if (const auto expected = expected_indirect(r, summary.views))
    lines += fmt::format(
        "expect an error of the indirect light of about {} on surfaces, and of up to {} in translucent "
        "scenes "
        "and mirrors; more pixels a cell make it smaller\n",
        percent(expected->surfaces), percent(expected->scattering));
  if (r.reciprocity.measured)
    lines += fmt::format(
        "map corrected by reciprocity: {:.4f} cells rms along an axis; {:.4f} are not known of it\n",
        r.reciprocity.corrected, r.reciprocity.left);
  if (weights.cells_without_core() > 0)
    lines += fmt::format(
        "{} cells without such a pixel, or with a black middle, are measured by all pixels that they share\n",
        grouped(static_cast<double>(weights.cells_without_core())));
  if (r.gain.known)
    lines += fmt::format(
        "gain of camera over projector: {:.3f} between cells, known to {}, corrected; veiling glare {:.2g} ± "
        "{:.1g}\n",
        r.gain.spread(r.cells), percent(r.gain.sigma), r.gain.veil, r.gain.veil_sigma);
  else
    lines +=
        "gain of camera over projector: not known, because the scene's parts exchange too little light; "
        "vignetting is not corrected\n";
  if (r.ghost.found) lines += "ghost: " + ghost_text(r.ghost) + "\n";
  return lines;
}

namespace {

using namespace report;

constexpr int kLeastWidth = 420;   // two pictures fill a row
constexpr int kLongestSide = 900;  // pixels of the longer side of a picture
/// Cells between two lines of the net that is drawn into the camera's picture.
constexpr int kNet = 8;
constexpr Rgb kLine{255, 96, 0};

/// How often a picture's pixels are repeated, so that lines are thin and pictures large enough.
int enlargement(Grid camera) {
  return std::clamp(kLongestSide / std::max(camera.rows, camera.cols), 1, 4);
}

/// The flood-lit scene as the camera sees it, with each eighth border of the cells.
Picture netted(const Registration& r) {
  const int times = enlargement(r.camera());
  const Picture lit = photograph(r.flood.mean, white_level(r.flood.mean));
  const Grid grid{r.camera().rows * times, r.camera().cols * times};
  Picture picture(grid, lit.channels());
  for (int c = 0; c < lit.channels(); ++c)
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col) picture.at(row, col, c) = lit.at(row / times, col / times, c);
  const CameraMap& map = r.maps.front();
  const auto net = [&](double row, double col) {
    const Point at = map.look({row / times, col / times});
    const bool inside =
        at.row > -0.01 && at.col > -0.01 && at.row < r.cells.rows + 0.01 && at.col < r.cells.cols + 0.01;
    return inside ? std::pair(static_cast<int>(std::floor(at.row / kNet)),
                              static_cast<int>(std::floor(at.col / kNet)))
                  : std::pair(-1, -1);
  };
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const auto here = net(row, col);
      if (here == net(row + 1, col) && here == net(row, col + 1)) continue;
      for (int c = 0; c < picture.channels(); ++c) picture.at(row, col, c) = kLine[c];
    }
  return picture;
}

std::string weighting_text(Weighting weighting) {
  switch (weighting) {
    case Weighting::cores:
      return "the pixels that lie inside it, and its part of those on its border";
    case Weighting::area:
      return "the area of all pixels that it shares";
    case Weighting::unmixed:
      return "the pixels that it shares, unmixed by the shift";
  }
  return {};
}

std::string parallax_text(const Parallax& parallax) {
  return fmt::format("{:.2f} cells{}", parallax.range,
                     require_coaxial(parallax).ok() ? "" : ": only brute and dual can capture this rig");
}

std::string registration_facts(const RegistrationSummary& s) {
  const Registration& r = s.registration;
  const std::string not_measured = s.views.single()
                                       ? "not needed: edges are sharp"
                                       : "not measured: the light of other views looks like blur";
  std::vector<std::pair<std::string, std::string>> rows{
      {"Photographs", grouped(static_cast<double>(r.photographs))},
      {"Camera, cells", to_string(r.camera()) + ", " + to_string(r.cells)},
      {"Camera pixels along the side of a cell", fmt::format("{:.2f}", r.pixels_per_cell())},
      {"Error of the map, along an axis", fmt::format("{:.4f} cells", r.error())},
      {"Width of an edge between two cells", fmt::format("{:.2f} cells", r.maps.front().edge_width())},
      {"Edges that do not fit", percent(r.maps.front().outlier_share())},
      {"Parallax, from the nearest to the farthest part", parallax_text(s.shape.parallax)},
      {"Cells that the camera sees", grouped(static_cast<double>(s.weights.valid_cells()))},
      {"Cells measured by shared pixels", grouped(static_cast<double>(s.weights.cells_without_core()))},
      {"Gain of camera over projector",
       r.gain.known
           ? fmt::format("{:.3f} between cells, known to {}", r.gain.spread(r.cells), percent(r.gain.sigma))
           : std::string("not known: too little light is exchanged")},
      {"A cell is measured by", weighting_text(r.weighting())},
      {"Blur of projector and camera", r.blur.measured
                                           ? fmt::format("{:.3f} and {:.3f} cells rms, difference ± {:.3f}",
                                                         r.blur.projector, r.blur.camera, r.blur.sigma)
                                           : not_measured},
      {"Map corrected by reciprocity",
       r.reciprocity.measured ? fmt::format("{:.4f} cells rms along an axis; {:.4f} are not known of it",
                                            r.reciprocity.corrected, r.reciprocity.left)
                              : not_measured},
      {"Variance of a cell, by that of a pixel", fmt::format("{:.2f}", s.weights.noise_share())}};
  if (r.ghost.found) rows.emplace_back("Ghost", ghost_text(r.ghost));
  return facts_table(rows);
}

}  // namespace

Result<std::string> registration_page(const RegistrationSummary& summary) {
  const Registration& r = summary.registration;
  SYMRIG_TRY(const Radiance cells, summary.weights.gather(r.flood));
  const Image<float> bent = r.maps.front().bend(r.cells);
  const float most = std::max(*std::ranges::max_element(bent.plane(0)), 1e-6F);
  const std::string title = r.rig + ": registration";
  std::string html =
      "<h1>" + escape(r.rig) + "</h1>\n" + section("facts", "Registration", registration_facts(summary));
  html += section(
      "map", "The map",
      row_of({figure(netted(r), "the cells in the camera's picture",
                     fmt::format("The flood-lit scene as the camera sees it. Lines: each {}th border between "
                                 "cells of the projector.",
                                 kNet)),
              figure(photograph(cells.mean, white_level(cells.mean)), "the scene on the cells",
                     "The same photograph on the projector's cells, as a capture uses it. Black: the camera "
                     "does not see the cell.")},
             kLeastWidth));
  html += section(
      "bend", "Distortion",
      row_of(
          {figure(false_colour(shrunk(bent, kLongestSide), most), "distortion",
                  "Distance of the map from the nearest affine map: distortion of the lenses, perspective, "
                  "and parallax.",
                  colour_scale("0", fmt::format("{:.2f} cells", static_cast<double>(most))))},
          kLeastWidth));
  return page(title, html);
}

}  // namespace symrig
