// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"
#include "report/picture.hpp"
#include "symrig/report/registration_summary.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
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
