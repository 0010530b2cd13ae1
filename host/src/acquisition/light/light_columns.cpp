// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_columns.hpp"

#include "acquisition/light/light_tests.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

namespace symrig::acquisition {

LightColumns::LightColumns(const TransportTensor& measured)
    : tensor_(measured),
      grid_(measured.camera_grid()),
      pixels_(measured.camera_tree().order().size()),
      most_(pixels_.size()),
      least_(pixels_.size(), std::numeric_limits<double>::infinity()),
      entries_(pixels_.size()) {
  const auto order = tensor_.camera_tree().order();
  for (std::size_t t = 0; t < order.size(); ++t) pixels_[static_cast<std::size_t>(order[t])] = t;
  for (const SparseColumn& column : tensor_.columns())
    for (std::int64_t at = column.first; at < column.last; ++at) {
      const auto row = static_cast<std::size_t>(tensor_.column_rows()[static_cast<std::size_t>(at)]);
      most_[row] = std::max(most_[row], value(at));
      least_[row] = std::min(least_[row], value(at));
      ++entries_[row];
    }
  for (std::size_t row = 0; row < entries_.size(); ++row)
    if (entries_[row] < most_.size()) least_[row] = std::min(least_[row], 0.0);
  std::vector<double> sorted = most_;
  lit_ = kOfBright * quantile(sorted, kBright);
}

double LightColumns::light(std::size_t row, std::size_t col) const {
  const SparseColumn& column = tensor_.columns()[col];
  const auto rows = tensor_.column_rows().subspan(static_cast<std::size_t>(column.first),
                                                  static_cast<std::size_t>(column.last - column.first));
  const auto at = std::ranges::lower_bound(rows, static_cast<std::int32_t>(row));
  return at != rows.end() && *at == static_cast<std::int32_t>(row) ? value(column.first + (at - rows.begin()))
                                                                   : 0;
}

std::optional<std::size_t> LightColumns::seen_at(const ColumnWay& way, std::size_t col) const {
  const std::int64_t shown = static_cast<std::int64_t>(col) - way.order.late;
  if (shown < 0 || shown >= static_cast<std::int64_t>(size())) return std::nullopt;
  const auto [lit_row, lit_col] = place(static_cast<std::size_t>(shown));
  const int at_row = lit_row - way.down, at_col = lit_col - way.right;
  if (at_row < 0 || at_row >= grid_.rows || at_col < 0 || at_col >= grid_.cols) return std::nullopt;
  return pixels_[acquisition::seen_at(way.order.turn, grid_, at_row, at_col)];
}

double LightColumns::value(std::int64_t entry) const {
  const auto channels = static_cast<std::size_t>(tensor_.channels());
  double sum = 0;
  for (const float v : tensor_.column_values().subspan(static_cast<std::size_t>(entry) * channels, channels))
    sum += static_cast<double>(v);
  return sum;
}

std::size_t LightColumns::photographs_of_one_way() const {
  std::size_t found = 0;
  for (std::size_t from = 0; from < size(); ++from) {
    const SparseColumn& column = tensor_.columns()[from];
    bool strong = false;
    for (std::int64_t at = column.first; at < column.last && !strong; ++at) {
      const auto to = static_cast<std::size_t>(tensor_.column_rows()[static_cast<std::size_t>(at)]);
      strong = to != from && lit(to) && value(at) > kOwnLight * most_[to] &&
               light(from, to) < kNotBack * value(at);
    }
    found += strong ? 1 : 0;
  }
  return found;
}

namespace {

/// What brute force foretells and what a photograph shows, all channels added, by pixel in tree order.
struct Compared {
  std::vector<double> foretold, seen;
};

/// shown: by pixel in tree order. plus, minus: the photographs whose difference it gives. Pixels that are not
/// valid are 0 in both.
Compared compare(const TransportTensor& measured, std::span<const float> shown, const LightSeries& series,
                 LightSeries::Place plus, std::optional<LightSeries::Place> minus) {
  const auto order = measured.camera_tree().order();
  Compared found{std::vector<double>(order.size()), std::vector<double>(order.size())};
  std::vector<float> light(order.size());
  for (int channel = 0; channel < measured.channels(); ++channel) {
    std::ranges::fill(light, 0.0F);
    measured.apply_tree(shown, light, channel, false);
    for (std::size_t t = 0; t < light.size(); ++t) found.foretold[t] += static_cast<double>(light[t]);
  }
  for (std::size_t t = 0; t < light.size(); ++t) {
    const auto at = static_cast<std::size_t>(order[t]);
    if (series.valid()[at] == 0) {
      found.foretold[t] = 0;
      continue;
    }
    found.seen[t] = static_cast<double>(series[plus].mean[at]);
    if (minus) found.seen[t] -= static_cast<double>(series[*minus].mean[at]);
  }
  return found;
}

/// The photograph of one lit pixel, all channels added. pixel and result: in raster order, because two
/// tensors may have two trees.
std::vector<double> photograph_of(const TransportTensor& tensor, std::size_t pixel) {
  const auto order = tensor.camera_tree().order();
  std::vector<float> shown(order.size()), light(order.size());
  std::vector<double> sum(order.size());
  for (std::size_t t = 0; t < order.size(); ++t)
    shown[t] = static_cast<std::size_t>(order[t]) == pixel ? 1.F : 0.F;
  for (int channel = 0; channel < tensor.channels(); ++channel) {
    std::ranges::fill(light, 0.0F);
    tensor.apply_tree(shown, light, channel, false);
    for (std::size_t t = 0; t < light.size(); ++t)
      sum[static_cast<std::size_t>(order[t])] += static_cast<double>(light[t]);
  }
  return sum;
}

/// A photograph of one pixel without its direct light, which the two halves show. All other light is in the
/// other photographs.
std::optional<LightFault> find_lost_photograph(const TransportTensor& measured, const LightSeries& series) {
  constexpr double kLost = 0.5;
  const LightColumns columns(measured);
  const LightPhotograph &half = series[LightSeries::kHalf], &other = series[LightSeries::kOtherHalf],
                        &flood = series[LightSeries::kFlood];
  const auto order = measured.camera_tree().order();
  std::vector<float> shown(order.size());
  for (std::size_t t = 0; t < shown.size(); ++t)
    shown[t] = half.lit[static_cast<std::size_t>(order[t])] != 0 ? 1 : -1;
  const Compared both = compare(measured, shown, series, LightSeries::kHalf, LightSeries::kOtherHalf);
  for (std::size_t t = 0; t < shown.size(); ++t) {
    const auto at = static_cast<std::size_t>(order[t]);
    if (series.valid()[at] == 0) continue;
    const auto light = static_cast<double>(flood.mean[at]);
    const double lacks = static_cast<double>(shown[t]) * (both.seen[t] - both.foretold[t]);
    // What is foretold has the noise of all photographs that hold some of this pixel's light.
    const double alone = std::min(static_cast<double>(series[LightSeries::kSparse].variance[at]),
                                  static_cast<double>(series[LightSeries::kOtherSparse].variance[at]));
    const double sigma =
        std::sqrt(static_cast<double>(half.variance[at]) + static_cast<double>(other.variance[at]) +
                  static_cast<double>(columns.entries(t)) * alone);
    if (light <= 0 || lacks < std::max(kLost * light, kLightSigmas * sigma) ||
        columns.light(t, t) > kNotBack * lacks)
      continue;
    return LightFault{
        fmt::format("photograph {}, of one pixel alone, lacks {} of the light that this pixel has if all "
                    "are lit",
                    t + 1, percent_of_light(lacks / light)),
        causes_of_missing_light()};
  }
  return std::nullopt;
}

}  // namespace

bool are_columns(const TransportTensor& measured) {
  const auto columns = measured.columns();
  if (measured.symmetric() || measured.camera_grid() != measured.projector_grid() ||
      measured.camera_grid().size() < kFewestPixels ||
      std::ranges::ssize(columns) != measured.camera_grid().size())
    return false;
  for (std::size_t k = 0; k < columns.size(); ++k)
    if (columns[k].col_begin != static_cast<std::int32_t>(k) ||
        columns[k].col_end != columns[k].col_begin + 1)
      return false;
  return true;
}

Result<void> check_capture_by_columns(const TransportTensor& found, const TransportTensor& measured,
                                      const LightSeries& series) {
  constexpr double kDiffers = 0.5, kOfBright = 0.3, kBright = 0.9;
  const LightColumns columns(measured);
  const double noise = series.sum(LightSeries::kSparse).sigma;  // of the light of one photograph
  std::vector<double> most_of(columns.size());
  for (std::size_t col = 0; col < columns.size(); ++col) most_of[col] = columns.most(col);
  const double bright = kOfBright * quantile(most_of, kBright);
  std::size_t wrong = 0, first = 0;
  double most = 0;
  for (std::size_t col = 0; col < columns.size(); ++col) {
    if (!columns.lit(col) || columns.most(col) < bright) continue;
    const auto pixel = static_cast<std::size_t>(measured.camera_tree().order()[col]);
    const std::vector<double> alone = photograph_of(measured, pixel), searched = photograph_of(found, pixel);
    double difference = 0, light = 0, captured = 0;
    for (std::size_t at = 0; at < alone.size(); ++at) {
      if (series.valid()[at] == 0) continue;
      difference += (searched[at] - alone[at]) * (searched[at] - alone[at]);
      light += alone[at] * alone[at], captured += searched[at] * searched[at];
    }
    const double all = std::max(light, captured);
    if (!(all > 0) || difference < kDiffers * kDiffers * all || std::sqrt(difference) < kLightSigmas * noise)
      continue;
    if (wrong == 0) first = col;
    most = std::max(most, std::sqrt(difference / all));
    ++wrong;
  }
  if (wrong == 0) return {};
  return LightFault{
      fmt::format("the capture has other light for {} pixel{} than photographs of them alone, "
                  "taken after it: up to {} at {}",
                  wrong, wrong == 1 ? "" : "s", percent_of_light(most), columns.name(first)),
      {{"a frame came late or twice during the capture, or one without light", late_frame().next},
       {"a lamp that flickers", ""},
       {"the camera, the projector or the scene has moved", ""}}}
      .error();
}

Result<void> check_sum_of_columns(const TransportTensor& measured, const LightSeries& series,
                                  const LookAside& look) {
  constexpr double kLeast = 0.05;
  if (const std::optional<LightFault> lost = find_lost_photograph(measured, series)) return lost->error();
  const std::vector<float> white(series.valid().size(), 1.0F);
  const Compared all = compare(measured, white, series, LightSeries::kFlood, std::nullopt);
  const double wanted = std::accumulate(all.seen.begin(), all.seen.end(), 0.0),
               together = std::accumulate(all.foretold.begin(), all.foretold.end(), 0.0);
  const double excess = wanted > 0 ? together / wanted - 1 : 0;
  if (std::abs(excess) < kLeast) return {};
  SYMRIG_TRY(const BlackAndWhite aside, look_at_black_and_white(series, look));
  if (!aside.known || std::abs(aside.black) < kLightSigmas * aside.black_sigma ||
      aside.black * static_cast<double>(white.size()) / excess < kOwnLight)
    return {};
  return LightFault{
      fmt::format("the light does not add up: the photographs of single pixels together have {}{} "
                  "of the light that all pixels give",
                  excess > 0 ? "+" : "", percent_of_light(excess)),
      {other_light(aside.black)}}
      .error();
}

}  // namespace symrig::acquisition
