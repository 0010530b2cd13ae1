// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/calibration_summary.hpp"

#include "report/json_text.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace symrig
