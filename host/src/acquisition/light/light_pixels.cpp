// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_series.hpp"
#include "acquisition/light/light_tests.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace symrig::acquisition {
namespace {

using Found = std::optional<LightFault>;

std::string place(const LightSeries& series, std::size_t at) {
  const auto cols = static_cast<std::size_t>(series.grid().cols);
  return fmt::format("row {}, column {}", at / cols, at % cols);
}

double mean_flood(const LightSeries& series) {
  return series.sum(LightSeries::kFlood).value / static_cast<double>(series.pixels());
}

/// Many pixels of the flood-lit photograph have its largest value, although noise should part them. Values
/// that are rounded to codes are equal too, but then the code below has about as many.
Found find_clipping(const LightSeries& series) {
  constexpr std::int64_t kFewest = 4, kTimes = 4;
  constexpr double kShare = 1e-3;
  const LightPhotograph& flood = series[LightSeries::kFlood];
  float most = 0, next = 0;
  std::int64_t equal = 0, below = 0;
  double variance = 0;
  for (std::size_t at = 0; at < series.valid().size(); ++at) {
    if (series.valid()[at] == 0) continue;
    const float light = flood.mean[at];
    if (light > most) {
      next = most, below = equal, most = light, equal = 0, variance = 0;
    } else if (light < most && light > next) {
      next = light, below = 0;
    }
    if (light == next) ++below;
    if (light == most) ++equal, variance += static_cast<double>(flood.variance[at]);
  }
  const double sigma = equal > 0 ? std::sqrt(variance / static_cast<double>(equal)) : 0;
  const bool piled = equal >= std::max(kFewest, kTimes * below) &&
                     static_cast<double>(equal) >= kShare * static_cast<double>(series.pixels());
  // Values that are rounded to coarse steps are equal too; then the next one is far away.
  if (!piled || !(sigma > static_cast<double>(most) - static_cast<double>(next)) || most <= 0)
    return std::nullopt;
  return LightFault{fmt::format("{} pixels of the flood-lit photograph have exactly its largest value, "
                                "{:.4g}, although their noise "
                                "is {:.2g}",
                                equal, most, sigma),
                    {{"a camera or a merge that clips there, and says that the pixels are valid",
                      "expose shorter, and state clipped pixels as not valid"}}};
}

/// The least and the largest value of a pixel in all photographs.
struct Extremes {
  double least, most;
};
Extremes extremes(const LightSeries& series, std::size_t at) {
  Extremes found{series[0].mean[at], series[0].mean[at]};
  for (std::size_t k = 1; k < series.size(); ++k) {
    found.least = std::min(found.least, static_cast<double>(series[k].mean[at]));
    found.most = std::max(found.most, static_cast<double>(series[k].mean[at]));
  }
  return found;
}

/// Bright pixels that do not depend on the pattern. Of light, the two halves of the patterns share what both
/// together give.
Found find_stuck(const LightSeries& series) {
  constexpr double kConstant = 0.8, kBright = 0.05, kMost = 0.1;
  const double bright = kBright * mean_flood(series);
  std::vector<std::size_t> stuck;
  for (std::size_t at = 0; at < series.valid().size(); ++at) {
    if (series.valid()[at] == 0) continue;
    const auto [least, most] = extremes(series, at);
    const double noise = std::sqrt(static_cast<double>(series[LightSeries::kFlood].variance[at]));
    if (most > bright && least > kConstant * most && most > kLightSigmas * noise) stuck.push_back(at);
  }
  if (stuck.empty() || static_cast<double>(stuck.size()) > kMost * static_cast<double>(series.pixels()))
    return std::nullopt;
  const std::size_t first = stuck.front();
  const std::string which = stuck.size() == 1 ? fmt::format("the pixel at {} has", place(series, first))
                                              : fmt::format("{} pixels, the first one at {}, have",
                                                            stuck.size(), place(series, first));
  return LightFault{
      fmt::format("{} the same value under all patterns: {:.3g}, where all light gives {:.3g} on average",
                  which, extremes(series, first).most, mean_flood(series)),
      {stuck_pixels()}};
}

/// Rows or columns, counted along one axis.
struct Lines {
  const char* name;
  int count, length;
  std::size_t step, along;  // to the next line, and to the next pixel of a line

  double light(const LightSeries& series, std::size_t k, int line, double* variance = nullptr) const {
    double sum = 0;
    for (int at = 0; at < length; ++at) {
      const std::size_t pixel = static_cast<std::size_t>(line) * step + static_cast<std::size_t>(at) * along;
      if (series.valid()[pixel] == 0) continue;
      sum += series[k].mean[pixel];
      if (variance != nullptr) *variance += static_cast<double>(series[k].variance[pixel]);
    }
    return sum;
  }
  bool dark(const LightSeries& series, int line) const {
    constexpr double kDark = 5e-3;
    double variance = 0;
    const double here = light(series, LightSeries::kFlood, line, &variance);
    const double beside =
        std::min(light(series, LightSeries::kFlood, line - 1), light(series, LightSeries::kFlood, line + 1));
    return variance > 0 && beside > 0 && std::abs(here) < std::max(kDark * beside, 3 * std::sqrt(variance)) &&
           beside * kDark > std::sqrt(variance) / 3;
  }
};

/// Whether the light of a line reaches other pixels, although no light is seen on the line: by reciprocity,
/// the camera would see it if it could.
Result<bool> gives_light(const LightSeries& series, const Lines& lines, int line, const LookAside& look) {
  constexpr double kUnseen = 0.05;
  Pattern pattern(series.grid());
  for (int at = 0; at < lines.length; ++at)
    pattern
        .values()[static_cast<std::size_t>(line) * lines.step + static_cast<std::size_t>(at) * lines.along] =
        1;
  SYMRIG_TRY(const std::vector<Radiance> seen, look(std::span(&pattern, 1), {}));
  if (seen.size() != 1) return false;
  double all = 0, variance = 0, here = 0;
  for (int channel = 0; channel < seen.front().mean.channels(); ++channel) {
    const auto mean = seen.front().mean.plane(channel), noise = seen.front().variance.plane(channel);
    for (std::size_t at = 0; at < mean.size(); ++at) {
      if (series.valid()[at] == 0) continue;
      all += static_cast<double>(mean[at]), variance += static_cast<double>(noise[at]);
      if (pattern.values()[at] == 1) here += static_cast<double>(mean[at]);
    }
  }
  return all > 0 && all > kLightSigmas * std::sqrt(variance) && std::abs(here) < kUnseen * all;
}

/// The mean light of unlit pixels beside one that is lit, and of unlit ones farther away that have no lit one
/// beside. None: too few of either.
std::optional<std::array<double, 2>> light_beside(const LightSeries& series, const LightPhotograph& seen,
                                                  int row, int col) {
  constexpr int kReach = 3;
  const Grid grid = series.grid();
  const auto pixel = [&](int r, int c) {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(grid.cols) + static_cast<std::size_t>(c);
  };
  const auto lit_beside = [&](int r, int c) {
    return (r > 0 && seen.lit[pixel(r - 1, c)] != 0) ||
           (r + 1 < grid.rows && seen.lit[pixel(r + 1, c)] != 0) ||
           (c > 0 && seen.lit[pixel(r, c - 1)] != 0) || (c + 1 < grid.cols && seen.lit[pixel(r, c + 1)] != 0);
  };
  LightMean near, far;
  for (int r = std::max(0, row - kReach); r < std::min(grid.rows, row + kReach + 1); ++r)
    for (int c = std::max(0, col - kReach); c < std::min(grid.cols, col + kReach + 1); ++c) {
      const std::size_t at = pixel(r, c);
      if (series.valid()[at] == 0 || seen.lit[at] != 0) continue;
      const int distance = std::abs(r - row) + std::abs(c - col);
      if (distance == 1) near.add(static_cast<double>(seen.mean[at]));
      if (distance > 2 && !lit_beside(r, c)) far.add(static_cast<double>(seen.mean[at]));
    }
  if (near.count == 0 || far.count < 4) return std::nullopt;
  return std::array{near.mean(), far.mean()};
}

/// Light beside lit pixels that is below that farther away. Light only adds to what is there. What is near is
/// compared, because elsewhere a scene may have more light. A camera that sharpens takes the same share of
/// each lit pixel's light: the slope of a line through the origin.
Found find_sharpening(const LightSeries& series) {
  constexpr double kSure = 6, kShare = 2e-3;
  constexpr std::size_t kFewest = 16;
  const Grid grid = series.grid();
  std::vector<std::array<double, 2>> pairs;  // a pixel's light, and how much less is beside it
  double product = 0, squares = 0;
  for (const std::size_t k : {LightSeries::kSparse, LightSeries::kOtherSparse})
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col) {
        const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.cols) +
                               static_cast<std::size_t>(col);
        if (series.valid()[at] == 0 || series[k].lit[at] == 0) continue;
        const auto beside = light_beside(series, series[k], row, col);
        if (!beside) continue;
        const double lit = static_cast<double>(series[k].mean[at]), less = (*beside)[1] - (*beside)[0];
        pairs.push_back({lit, less});
        product += lit * less, squares += lit * lit;
      }
  if (pairs.size() < kFewest || squares <= 0) return std::nullopt;
  const double share = product / squares;
  double residuals = 0;
  for (const auto& [lit, less] : pairs) residuals += (less - share * lit) * (less - share * lit);
  const double sigma = std::sqrt(residuals / static_cast<double>(pairs.size() - 1) / squares);
  if (share < kShare || share < kSure * sigma) return std::nullopt;
  return sharpening(share);
}

}  // namespace

Found find_wrong_pixels(const LightSeries& series) {
  for (const auto find : {find_clipping, find_stuck, find_sharpening})
    if (Found found = find(series)) return found;
  return std::nullopt;
}

Result<Found> find_dead_lines(const LightSeries& series, const LookAside& look) {
  constexpr int kOneOf = 50;  // stripes of a scene are many
  if (!look) return Found();
  const Grid grid = series.grid();
  const auto cols = static_cast<std::size_t>(grid.cols);
  for (const Lines& lines :
       {Lines{"row", grid.rows, grid.cols, cols, 1}, Lines{"column", grid.cols, grid.rows, 1, cols}}) {
    std::vector<int> dead;
    for (int line = 1; line + 1 < lines.count; ++line)
      if (lines.dark(series, line)) dead.push_back(line);
    if (dead.empty() || static_cast<int>(dead.size()) > std::max(1, lines.count / kOneOf)) continue;
    SYMRIG_TRY(const bool gives, gives_light(series, lines, dead.front(), look));
    if (!gives) continue;
    return Found(
        LightFault{fmt::format("{0} {1} is dark under all patterns, between {0}s that are lit; if it alone "
                               "is lit, other pixels see "
                               "its light",
                               lines.name, dead.front()),
                   {{fmt::format("a dead {} of the camera", lines.name), "state its pixels as not valid"}}});
  }
  return Found();
}

}  // namespace symrig::acquisition
