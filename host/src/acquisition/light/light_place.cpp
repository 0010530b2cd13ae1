// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_series.hpp"
#include "acquisition/light/light_tests.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

/// The light of a pixel in the photograph of its half, less that in the photograph of the other half: its
/// direct light, and a random part of mean 0 of all other light.
double direct(const LightSeries& series, std::size_t at) {
  const double difference = static_cast<double>(series[LightSeries::kHalf].mean[at]) -
                            static_cast<double>(series[LightSeries::kOtherHalf].mean[at]);
  return series[LightSeries::kHalf].lit[at] != 0 ? difference : -difference;
}

/// Light of photograph k on the pixels that pattern x lights, over their direct light.
struct PixelAnswer {
  double share = 0;    ///< below 1: the pixels lack light if they were lit
  bool known = false;  ///< the direct light is known well enough
};
PixelAnswer answer_of(const LightSeries& series, const LightMatch& match, std::size_t k, std::size_t x) {
  double light = 0, wanted = 0, squares = 0;
  for (std::size_t at = 0; at < series.valid().size(); ++at) {
    if (series.valid()[at] == 0 || series[x].lit[at] == 0) continue;
    const double d = direct(series, at);
    light += series[k].mean[at], wanted += d, squares += d * d;
  }
  const double random = std::max(0.0, 1 - match.as_shown() * match.as_shown());
  return {wanted > 0 ? light / wanted : 0,
          wanted > kLightSigmas * std::sqrt(2 * random * squares) && wanted > 0};
}

LightFault dark_photograph(const LightSeries& series, std::size_t k, double share) {
  return {fmt::format(
              "photograph {} ({}) has only {} of the light that the other photographs give for its pattern",
              k + 1, series[k].name, percent_of_light(std::max(share, 0.0))),
          causes_of_missing_light()};
}

/// The flood-lit photograph and those of the halves, each from the other two.
std::optional<LightFault> find_dark_half(const LightSeries& series) {
  constexpr double kDark = 0.2;
  const double all = series.sum(LightSeries::kFlood).value, half = series.sum(LightSeries::kHalf).value,
               other = series.sum(LightSeries::kOtherHalf).value;
  const std::array<double, 3> wanted{half + other, all - other, all - half}, seen{all, half, other};
  for (std::size_t k = 0; k < wanted.size(); ++k)
    if (wanted[k] > kDark * std::max({all, half, other}) && seen[k] < kDark * wanted[k])
      return dark_photograph(series, k, seen[k] / wanted[k]);
  return std::nullopt;
}

struct Shift {
  int row = 0, col = 0;
  double correlation = 0;
};

/// Of the difference of the halves with the pattern of one, moved by (row, col).
double correlation_at(const LightSeries& series, int row, int col) {
  const Grid grid = series.grid();
  const LightPhotograph& half = series[LightSeries::kHalf];
  double product = 0, squares = 0, count = 0;
  for (int r = std::max(0, -row); r < grid.rows - std::max(0, row); ++r)
    for (int c = std::max(0, -col); c < grid.cols - std::max(0, col); ++c) {
      const auto at =
          static_cast<std::size_t>(r) * static_cast<std::size_t>(grid.cols) + static_cast<std::size_t>(c);
      if (series.valid()[at] == 0) continue;
      const double light =
          static_cast<double>(half.mean[at]) - static_cast<double>(series[LightSeries::kOtherHalf].mean[at]);
      const auto to = static_cast<std::size_t>(r + row) * static_cast<std::size_t>(grid.cols) +
                      static_cast<std::size_t>(c + col);
      product += half.lit[to] != 0 ? light : -light;
      squares += light * light, count += 1;
    }
  return squares > 0 ? product / std::sqrt(squares * count) : 0;
}

Shift best_shift(const LightSeries& series) {
  constexpr int kReach = 16;
  const Grid grid = series.grid();
  const int rows = std::min(kReach, grid.rows / 4), cols = std::min(kReach, grid.cols / 4),
            wide = 2 * cols + 1;
  std::vector<Shift> all(static_cast<std::size_t>(2 * rows + 1) * static_cast<std::size_t>(wide));
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t k) {
    const int row = static_cast<int>(k) / wide - rows, col = static_cast<int>(k) % wide - cols;
    all[k] = {row, col, correlation_at(series, row, col)};
  });
  return *std::ranges::max_element(all, {}, &Shift::correlation);
}

std::string name_shift(const Shift& shift) {
  std::string text;
  if (shift.row != 0)
    text = fmt::format("{} row{} {}", std::abs(shift.row), std::abs(shift.row) == 1 ? "" : "s",
                       shift.row < 0 ? "up" : "down");
  if (shift.col != 0)
    text += fmt::format("{}{} column{} {}", text.empty() ? "" : " and ", std::abs(shift.col),
                        std::abs(shift.col) == 1 ? "" : "s", shift.col < 0 ? "to the left" : "to the right");
  return text;
}

}  // namespace

std::optional<LightFault> find_missing_light(const LightSeries& series, const LightMatch& match) {
  constexpr double kLacks = 0.25, kHas = 0.75;
  if (!match.follows()) return std::nullopt;
  if (auto dark = find_dark_half(series)) return dark;
  for (std::size_t k = LightSeries::kSparse; k < LightSeries::kCount; ++k) {
    const PixelAnswer own = answer_of(series, match, k, k);
    if (!own.known || own.share > kLacks) continue;
    for (const std::size_t x : {k - 1, k + 1 < LightSeries::kCount ? k + 1 : k - 1}) {
      const PixelAnswer other = answer_of(series, match, k, x);
      if (other.known && other.share > kHas)
        return LightFault{
            fmt::format(
                "photograph {} ({}) has {} of the light of its own pattern, and all light of pattern {} ({})",
                k + 1, series[k].name, percent_of_light(std::max(own.share, 0.0)), x + 1, series[x].name),
            {{x < k ? "a frame came late or twice" : "a frame was lost",
              "empty the camera's queue before each pattern, and tie each photograph to its trigger"}}};
    }
    return dark_photograph(series, k, own.share);
  }
  return std::nullopt;
}

std::optional<LightFault> find_afterglow(const LightSeries& series, const LightMatch& match) {
  constexpr double kSureOfGlow = 8, kLeastGlow = 0.01, kLeastDirect = 0.2, kFewest = 12;
  if (!match.follows()) return std::nullopt;
  const double least =
      kLeastDirect * series.sum(LightSeries::kFlood).value / static_cast<double>(series.pixels());
  LightMean before, neither;  // light of unlit pixels over their direct light
  // The sparse patterns and what follows: hardly any light is elsewhere.
  for (const std::size_t k : {LightSeries::kOtherSparse, LightSeries::kBar})
    for (std::size_t at = 0; at < series.valid().size(); ++at) {
      const double own = direct(series, at);
      if (series.valid()[at] == 0 || series[k].lit[at] != 0 || own < least) continue;
      (series[k - 1].lit[at] != 0 ? before : neither).add(static_cast<double>(series[k].mean[at]) / own);
    }
  const double glow = before.mean() - neither.mean();
  if (std::min(before.count, neither.count) < kFewest || glow < kLeastGlow ||
      glow < kSureOfGlow * std::sqrt(before.variance_of_mean() + neither.variance_of_mean()))
    return std::nullopt;
  return afterglow(glow);
}

std::optional<LightFault> find_shift(const LightSeries& series, const LightMatch& match) {
  constexpr double kSureOfShift = 8, kClearly = 2;
  if (match.follows() && match.as_shown() > 1 / kClearly) return std::nullopt;
  if (!exchanged_light(series).significant) return std::nullopt;
  const Shift best = best_shift(series);
  const double in_place = std::max(correlation_at(series, 0, 0), 0.0);
  if (best.correlation < kSureOfShift / std::sqrt(static_cast<double>(series.pixels())) ||
      best.correlation < kClearly * in_place)
    return std::nullopt;
  return LightFault{fmt::format("the light lies beside the lit pixels: the correlation is {:.2f} in place, "
                                "and {:.2f} if the camera "
                                "looks {}",
                                in_place, best.correlation, name_shift(best)),
                    {{"a camera that is not aligned with the projector, or has moved",
                      "align them (symrig align), or register the camera (symrig calibrate)"}}};
}

namespace {

/// Σ of the light of a photograph where a pattern is lit, all channels added, and its variance.
LightSeries::Sum light_where(const LightSeries& series, const Radiance& photograph,
                             std::span<const float> lit) {
  double value = 0, variance = 0;
  for (int channel = 0; channel < photograph.mean.channels(); ++channel) {
    const auto mean = photograph.mean.plane(channel), noise = photograph.variance.plane(channel);
    const auto valid = photograph.valid.plane(channel);
    for (std::size_t at = 0; at < mean.size(); ++at)
      if (series.valid()[at] != 0 && valid[at] != 0 && lit[at] > 0)
        value += static_cast<double>(mean[at]), variance += static_cast<double>(noise[at]);
  }
  return {value, std::sqrt(variance)};
}

}  // namespace

// The pixels that look bright are chosen by one photograph, and their light is that of another: noise that
// chose them is not in that.
Result<std::optional<LightFault>> find_other_pixels(const LightSeries& series, const LightMatch& match,
                                                    const LookAside& look) {
  constexpr double kBright = 0.5, kComesBack = 0.5;
  const std::optional<LightFault> none;
  if (match.follows() || series.pixels() < kFewestInOrder || !look || !exchanged_light(series).significant)
    return none;
  const LightPhotograph& there = series[LightSeries::kSparse];
  const double least = kBright * static_cast<double>(*std::ranges::max_element(there.mean));
  Pattern bright(series.grid()), sparse(series.grid());
  for (std::size_t at = 0; at < series.valid().size(); ++at) {
    sparse.values()[at] = there.lit[at] != 0 ? 1.F : 0.F;
    if (series.valid()[at] != 0 && static_cast<double>(there.mean[at]) >= least) bright.values()[at] = 1;
  }
  const std::vector<Pattern> shown{sparse, bright};
  SYMRIG_TRY(const std::vector<Radiance> seen, look(shown, {}));
  if (seen.size() != shown.size() || seen.front().mean.grid() != series.grid()) return none;
  const LightSeries::Sum sent = light_where(series, seen[0], bright.values()),
                         back = light_where(series, seen[1], sparse.values());
  if (!sent.above(kLightSigmas) || back.value > kComesBack * sent.value ||
      sent.value - back.value < kLightSigmas * std::hypot(sent.sigma, back.sigma))
    return none;
  return std::optional(LightFault{
      fmt::format("light does not come back: if the pixels that are bright in photograph {} ({}) are lit "
                  "themselves, {} of their light is seen where it came from",
                  LightSeries::kSparse + 1, there.name,
                  percent_of_light(std::max(back.value, 0.0) / sent.value)),
      causes_of_other_pixels()});
}

}  // namespace symrig::acquisition
