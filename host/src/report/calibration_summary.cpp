// SPDX-License-Identifier: Apache-2.0

#include "symrig/report/calibration_summary.hpp"

#include "report/html.hpp"
#include "report/picture.hpp"
#include "symrig/report/internal/json_text.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig {

namespace {

using report::Json;

double mean_where(const Image<std::uint8_t>& mask, const Image<float>& image) {
  double sum = 0;
  std::int64_t count = 0;
  for (std::size_t i = 0; i < mask.values().size(); ++i) {
    if (mask.values()[i] == 0) continue;
    sum += image.plane(0)[i];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

/// [smallest, largest] decoded position; [0, 0] if nothing is decoded; null if the axis is not known.
Json range_json(const Image<float>& position, const Image<std::uint8_t>& mask) {
  bool any = false;
  float least = 0, most = 0;
  for (std::size_t i = 0; i < mask.values().size(); ++i) {
    if (mask.values()[i] == 0) continue;
    const float x = position.values()[i];
    if (std::isnan(x)) return {};
    least = any ? std::min(least, x) : x;
    most = any ? std::max(most, x) : x;
    any = true;
  }
  return Json::array({least, most});
}

/// Calls use() with projector position minus camera position of each decoded pixel.
template <class Use>
void for_each_offset(const PixelMap& map, Use use) {
  for (int row = 0; row < map.camera.rows; ++row)
    for (int col = 0; col < map.camera.cols; ++col)
      if (map.mask.at(row, col) != 0)
        use(static_cast<double>(map.row.at(row, col)) - row, static_cast<double>(map.col.at(row, col)) - col);
}

Json rig_json(const RigSummary& rig) {
  return {{"predicted_noise", rig.predicted_noise},
          {"invalid_share", rig.invalid_share},
          {"offset", Json::array({rig.offset_row, rig.offset_col})},
          {"offset_rms", rig.offset_rms},
          {"rig_seconds", rig.rig_seconds}};
}

Json smooth_json(const SmoothMap& smooth) {
  return {{"rms_held_out", smooth.held_out.rms},
          {"share_planar", smooth.held_out.planar_share},
          {"share_far", smooth.held_out.far_share},
          {"share_described", smooth.known_share},
          {"share_marked", smooth.edge_share},
          {"pieces", smooth.pieces},
          {"knots", smooth.knots},
          {"smoothing", smooth.smoothing}};
}

Json statistics_json(const FitStatistics& s) {
  return {{"mean_white", s.mean_white},           {"lit_share", s.lit_share},
          {"decoded_share", s.decoded_share},     {"direct_share", s.direct_share},
          {"near_share", s.near_share},           {"surroundings", s.surroundings},
          {"near_reaches", s.near_reaches},       {"near_shares", s.near_shares},
          {"footprint_sigma", s.footprint_sigma}, {"residual", s.residual}};
}

}  // namespace

CalibrationSummary summarize(const std::string& source, const CodePhotographs& photographs,
                             const PixelMap& map) {
  return {.source = source,
          .photographs = photographs.code.photographs(),
          .mean_white = mean_where(map.mask, photographs.white()),
          .mean_black = mean_where(map.mask, photographs.black()),
          .quality = judge_map(map, {.stride = 4})};
}

RigSummary offsets_of(const PixelMap& map) {
  RigSummary summary;
  double count = 0;
  for_each_offset(map, [&](double rows, double cols) {
    summary.offset_row += rows;
    summary.offset_col += cols;
    ++count;
  });
  if (count == 0) return summary;
  summary.offset_row /= count;
  summary.offset_col /= count;
  double squares = 0;
  for_each_offset(map, [&](double rows, double cols) {
    squares += std::pow(rows - summary.offset_row, 2) + std::pow(cols - summary.offset_col, 2);
  });
  summary.offset_rms = std::sqrt(squares / count);
  return summary;
}

std::string calibration_json(const CalibrationSummary& summary, const PixelMap& map) {
  Json json;
  json["command"] = "calibrate";
  json["source"] = summary.source;
  json["photographs"] = summary.photographs;
  json["camera_grid"] = report::grid_json(map.camera);
  json["projector_grid"] = report::grid_json(map.projector);
  json["decoded_share"] = map.decoded_share();
  json["axes"] = map.axes == CodeAxes::both ? "both" : map.axes == CodeAxes::columns ? "columns" : "rows";
  json["columns"] = range_json(map.col, map.mask);
  json["rows"] = range_json(map.row, map.mask);
  json["mean_white"] = summary.mean_white;
  json["mean_black"] = summary.mean_black;
  json["noise"] = map.noise;
  json["quality"] = {{"lit_share", summary.quality.lit_share},
                     {"valid_share_of_lit", summary.quality.valid_share},
                     {"outlier_share", summary.quality.outlier_share},
                     {"residual_rms", summary.quality.rms}};
  if (summary.smooth) json["smooth"] = smooth_json(*summary.smooth);
  if (summary.rig) json["rig"] = rig_json(*summary.rig);
  return report::json_text(json);
}

std::string fit_json(const std::string& source, const CodePhotographs& photographs, const FirstBounceFit& fit,
                     const std::vector<HeldOutError>& held_out, double total_seconds, const Made& made) {
  const TransportTensor& tensor = fit.tensor;
  Json json;
  json["command"] = "fit";
  json["scene"] = source;
  json["algorithm"] = "first-bounce";
  json["photographs"] = photographs.code.photographs();
  json["grid"] = report::grid_json(tensor.projector_grid());
  json["camera_grid"] = report::grid_json(tensor.camera_grid());
  json["channels"] = tensor.channels();
  json["statistics"] = statistics_json(fit.statistics);
  json["held_out"] = report::held_out_json(held_out);
  json["leaves_per_level"] = report::leaves_json(tensor);
  json["tensor_bytes"] = tensor.bytes();
  json["dense_bytes"] = tensor.dense_bytes();
  json["seconds"] = {{"total", total_seconds}};
  report::add_made(json, made);
  return report::json_text(json);
}

Image<float> uncertainty_picture(const PixelMap& map) {
  Image<float> picture(map.camera, 3, -1.0F);
  const MapResiduals residuals = map_residuals(map);
  for (std::size_t i = 0; i < map.mask.values().size(); ++i) {
    if (map.mask.values()[i] == 0) continue;
    if (map.axes != CodeAxes::rows) picture.plane(0)[i] = map.col_sigma.values()[i];
    if (map.axes != CodeAxes::columns) picture.plane(1)[i] = map.row_sigma.values()[i];
    if (!std::isnan(residuals.col.values()[i])) picture.plane(2)[i] = residuals.distance(i);
  }
  return picture;
}

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
