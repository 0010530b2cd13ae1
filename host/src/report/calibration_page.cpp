// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"
#include "report/picture.hpp"
#include "symrig/report/calibration_summary.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig {
namespace {

using namespace report;

constexpr int kSide = 640;           // pixels of the longer side of a picture
constexpr int kNarrowest = 420;      // two pictures fill a row
constexpr std::uint8_t kNone = 150;  // grey, because the colour scale contains black and white, but no grey

/// Every `stride`th pixel of a picture on the camera's grid; pixels that are not decoded become grey.
/// Positions are not averaged: the mean of positions on two surfaces lies on neither.
class Thumbnails {
 public:
  explicit Thumbnails(const PixelMap& map)
      : map_(map),
        stride_(std::max(1, (std::max(map.camera.rows, map.camera.cols) + kSide - 1) / kSide)),
        grid_{(map.camera.rows + stride_ - 1) / stride_, (map.camera.cols + stride_ - 1) / stride_} {}

  int stride() const { return stride_; }

  /// value(row, col) of camera pixels, NaN if there is none.
  template <class Value>
  Picture coloured(double top, Value value) const {
    Image<float> values(grid_);
    Image<std::uint8_t> known(grid_);
    for (int r = 0; r < grid_.rows; ++r)
      for (int c = 0; c < grid_.cols; ++c) {
        const auto v = static_cast<double>(value(r * stride_, c * stride_));
        known.at(r, c) = std::isfinite(v) ? 1 : 0;
        values.at(r, c) = std::isfinite(v) ? static_cast<float>(std::clamp(v, 0.0, top)) : 0;
      }
    Picture picture = false_colour(values, static_cast<float>(top));
    for (int channel = 0; channel < picture.channels(); ++channel)
      for (std::size_t i = 0; i < known.values().size(); ++i)
        if (!known.values()[i]) picture.plane(channel)[i] = kNone;
    return picture;
  }
  /// One value of the decoded pixels.
  template <class Value>
  Picture decoded(double top, Value value) const {
    return coloured(top, [&](int r, int c) { return map_.mask.at(r, c) ? value(r, c) : std::nanf(""); });
  }

 private:
  const PixelMap& map_;
  int stride_;
  Grid grid_;
};

std::string positions_section(const PixelMap& map, const Thumbnails& small) {
  const auto shown = [&](const Image<float>& position, int size, const char* what) {
    return figure(small.decoded(size - 1, [&](int r, int c) { return position.at(r, c); }), what,
                  fmt::format("The projector {} that each camera pixel sees. Grey: not decoded.", what),
                  colour_scale("0", fmt::format("{}", size - 1)));
  };
  std::vector<std::string> figures;
  if (map.axes != CodeAxes::rows) figures.push_back(shown(map.col, map.projector.cols, "column"));
  if (map.axes != CodeAxes::columns) figures.push_back(shown(map.row, map.projector.rows, "row"));
  return section("map", "The map", row_of(figures, kNarrowest));
}

std::string doubts_section(const PixelMap& map, const Thumbnails& small) {
  constexpr double kSigma = 0.5, kOff = 1.5;  // [projector pixels] ends of the scales
  const MapResiduals off = map_residuals(map, {.stride = small.stride()});
  const std::size_t camera_cols = map.camera.cols;
  const auto sigma = [&](int r, int c) {
    const float col = map.col_sigma.at(r, c), row = map.row_sigma.at(r, c);
    return map.axes == CodeAxes::both ? std::max(col, row) : std::min(col, row);
  };
  const auto distance = [&](int r, int c) {
    return off.distance(static_cast<std::size_t>(r) * camera_cols + static_cast<std::size_t>(c));
  };
  return section(
      "doubts", "Uncertainty of the map",
      row_of(
          {figure(
               small.decoded(kSigma, sigma), "uncertainty",
               "Standard deviation of the position, the larger of column and row, in projector pixels. Grey: "
               "not decoded.",
               colour_scale("0", fmt::format("{} or more", kSigma))),
           figure(small.decoded(kOff, distance), "distance from the neighbours",
                  "Distance from an affine map of the 15 × 15 pixels around, in projector pixels. Lines are "
                  "edges "
                  "of surfaces. Single bright pixels are glints or wrong positions.",
                  colour_scale("0", fmt::format("{} or more", kOff)))},
          kNarrowest));
}

std::string smooth_section(const SmoothMap& smooth, const PixelMap& map, const Thumbnails& small) {
  constexpr double kOff = 0.5;  // [projector pixels] end of the scale
  const auto marks = small.decoded(1, [&](int r, int c) { return smooth.edges.at(r, c); });
  const auto distance = [&](int r, int c) {
    return smooth.known.at(r, c)
               ? std::hypot(map.col.at(r, c) - smooth.col.at(r, c), map.row.at(r, c) - smooth.row.at(r, c))
               : std::nanf("");
  };
  return section(
      "smooth", "Smooth model",
      row_of(
          {figure(
               marks, "edges",
               "White: no smooth model describes the positions here, or two surfaces meet. Black: a smooth "
               "model does. Grey: not decoded.",
               ""),
           figure(small.decoded(kOff, distance), "distance from the model",
                  "Distance of the decoded position from the smooth model, in projector pixels. Grey: not "
                  "decoded, or not described.",
                  colour_scale("0", fmt::format("{} or more", kOff)))},
          kNarrowest));
}

std::string facts(const CalibrationSummary& s, const PixelMap& map) {
  std::vector<std::pair<std::string, std::string>> rows{
      {"Photographs", grouped(s.photographs)},
      {"Camera, projector", to_string(map.camera) + ", " + to_string(map.projector)},
      {"Decoded, of all camera pixels", percent(map.decoded_share())},
      {"Decoded, of the lit ones", percent(s.quality.valid_share)},
      {"Of these, over 1.5 projector pixels from their neighbours' map", percent(s.quality.outlier_share)},
      {"Rms of the others, along an axis", fmt::format("{:.3f} projector pixels", s.quality.rms)},
      {"Noise of a photograph's pixel", short_number(map.noise) + " (1: largest code)"}};
  if (s.smooth) {
    const SmoothMap::HeldOut& held_out = s.smooth->held_out;
    rows.emplace_back("Left-out pixels on planar parts, rms from a smooth model along an axis",
                      fmt::format("{:.3f} projector pixels ({} of them are on planar parts)", held_out.rms,
                                  percent(held_out.planar_share)));
    rows.emplace_back("Marked as edges, of the decoded pixels", percent(s.smooth->edge_share));
  }
  if (s.rig)
    rows.emplace_back("Projector − camera position", fmt::format("rows {:+.3f}, columns {:+.3f} pixels",
                                                                 s.rig->offset_row, s.rig->offset_col));
  return facts_table(rows);
}

}  // namespace

std::string calibration_page(const CalibrationSummary& summary, const PixelMap& map) {
  const Thumbnails small(map);
  const Picture lit = photograph(shrunk(map.contrast, kSide), white_level(map.contrast));
  std::string html = "<h1>" + escape(summary.source) + "</h1>\n" +
                     section("facts", "Pixel map", facts(summary, map)) + positions_section(map, small) +
                     doubts_section(map, small);
  if (summary.smooth) html += smooth_section(*summary.smooth, map, small);
  html += section(
      "light", "Projector light",
      row_of(
          {figure(lit, "white minus black",
                  "White minus black photograph: the projector's light. Dark pixels here cannot be decoded. "
                  "Pixels that are bright here and grey above see only light from other surfaces.",
                  "")},
          kNarrowest));
  return page(summary.source + ": pixel map", html);
}

}  // namespace symrig
