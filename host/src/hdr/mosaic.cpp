// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/mosaic.hpp"

#include "symrig/base/text.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr int kColours = 3;

Radiance blank(Grid grid) {
  return {Image<float>(grid, kColours), Image<float>(grid, kColours), Image<std::uint8_t>(grid, kColours)};
}

Result<void> check_mosaic(const Radiance& mosaic) {
  if (mosaic.mean.channels() == 1 && mosaic.mean.grid().valid()) return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("a mosaic has one plane; this photograph has {}", mosaic.mean.channels()),
               "give the merged mosaic, before demosaicing"};
}

struct MosaicSample {
  double mean = 0, variance = 0;
  bool valid = false;
};

/// One colour of a pixel from its neighbouring samples.
MosaicSample around(const Radiance& mosaic, const BayerPattern& pattern, int row, int col, int colour) {
  const Grid grid = mosaic.mean.grid();
  double sum = 0, variance = 0, weights = 0;
  for (int y = std::max(0, row - 1); y <= std::min(grid.rows - 1, row + 1); ++y)
    for (int x = std::max(0, col - 1); x <= std::min(grid.cols - 1, col + 1); ++x) {
      if (pattern.at(y, x) != colour || mosaic.valid.at(y, x) == 0) continue;
      const double w = (y == row ? 2 : 1) * (x == col ? 2 : 1);
      sum += w * static_cast<double>(mosaic.mean.at(y, x));
      variance += w * w * static_cast<double>(mosaic.variance.at(y, x));
      weights += w;
    }
  if (weights <= 0) return {};
  return {sum / weights, variance / (weights * weights), true};
}

void put(const MosaicSample& sample, int row, int col, int colour, Radiance& into) {
  into.mean.at(row, col, colour) = static_cast<float>(sample.mean);
  into.variance.at(row, col, colour) = static_cast<float>(sample.variance);
  into.valid.at(row, col, colour) = sample.valid ? 1 : 0;
}

}  // namespace

Result<BayerPattern> parse_bayer(std::string_view name) {
  constexpr std::pair<std::string_view, std::array<int, 4>> kKnown[] = {
      {"RGGB", {0, 1, 1, 2}}, {"GRBG", {1, 0, 2, 1}}, {"GBRG", {1, 2, 0, 1}}, {"BGGR", {2, 1, 1, 0}}};
  for (const auto& [known, colours] : kKnown)
    if (known == name) return BayerPattern{colours};
  std::vector<std::string_view> names;
  for (const auto& one : kKnown) names.push_back(one.first);
  return Error{ErrorCode::unknown_name, fmt::format("there is no colour mosaic '{}'", name),
               nearest_hint(name, names)};
}

Result<Radiance> demosaic(const Radiance& mosaic, const BayerPattern& pattern) {
  SYMRIG_CHECK(check_mosaic(mosaic));
  const Grid grid = mosaic.mean.grid();
  Radiance colours = blank(grid);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      for (int c = 0; c < kColours; ++c) put(around(mosaic, pattern, row, col, c), row, col, c, colours);
  return colours;
}

Result<Radiance> split_mosaic(const Radiance& mosaic, const BayerPattern& pattern) {
  SYMRIG_CHECK(check_mosaic(mosaic));
  const Grid grid = mosaic.mean.grid();
  Radiance colours = blank(grid);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const int own = pattern.at(row, col);
      colours.mean.at(row, col, own) = mosaic.mean.at(row, col);
      colours.variance.at(row, col, own) = mosaic.variance.at(row, col);
      colours.valid.at(row, col, own) = mosaic.valid.at(row, col);
    }
  return colours;
}

Result<Radiance> colour_by_flood(const Radiance& mosaic, const Radiance& flood_mosaic,
                                 const BayerPattern& pattern) {
  SYMRIG_CHECK(check_mosaic(mosaic));
  SYMRIG_TRY(const Radiance flood, demosaic(flood_mosaic, pattern));
  const Grid grid = mosaic.mean.grid();
  if (flood.mean.grid() != grid)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the photograph is {}, the flood-lit one {}", to_string(grid),
                             to_string(flood.mean.grid())),
                 "give photographs of one camera"};
  Radiance colours = blank(grid);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      // The pixel's own sample of the flood-lit scene, not the mean around it. Only this makes the sums
      // exact.
      const auto own = static_cast<double>(flood_mosaic.mean.at(row, col));
      const double sigma = std::sqrt(static_cast<double>(flood_mosaic.variance.at(row, col)));
      const bool seen =
          mosaic.valid.at(row, col) != 0 && flood_mosaic.valid.at(row, col) != 0 && own > 3 * sigma;
      for (int c = 0; c < kColours && seen; ++c) {
        const bool is_own = c == pattern.at(row, col);
        const double ratio = is_own ? 1 : static_cast<double>(flood.mean.at(row, col, c)) / own;
        put({ratio * static_cast<double>(mosaic.mean.at(row, col)),
             ratio * ratio * static_cast<double>(mosaic.variance.at(row, col)),
             is_own || flood.valid.at(row, col, c) != 0},
            row, col, c, colours);
      }
    }
  return colours;
}

namespace {

/// What the sensor saw: each pixel has light in the channel of its own filter only.
Image<float> one_channel(const Image<float>& photograph) {
  Image<float> sum(photograph.grid());
  for (int channel = 0; channel < photograph.channels(); ++channel)
    for (std::size_t i = 0; i < sum.values().size(); ++i) sum.values()[i] += photograph.plane(channel)[i];
  return sum;
}

}  // namespace

Result<Image<float>> colour_factors(const Image<float>& flood, const BayerPattern& pattern) {
  constexpr double kDark = 1e-3;  // of the mean
  const Grid grid = flood.grid();
  Radiance flood_mosaic{one_channel(flood), Image<float>(grid), Image<std::uint8_t>(grid)};
  const auto values = flood_mosaic.mean.values();
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    flood_mosaic.valid.values()[i] = static_cast<double>(values[i]) > kDark * mean ? 1 : 0;
  const Radiance white{Image<float>(grid, 1, 1.F), Image<float>(grid), Image<std::uint8_t>(grid, 1, 1)};
  SYMRIG_TRY(Radiance colours, colour_by_flood(white, flood_mosaic, pattern));
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) colours.mean.at(row, col, pattern.at(row, col)) = 1;
  return std::move(colours.mean);
}

Image<float> coloured(const Image<float>& photograph, const Image<float>& factors) {
  const Image<float> own = one_channel(photograph);
  Image<float> picture = factors;
  for (int channel = 0; channel < picture.channels(); ++channel)
    for (std::size_t i = 0; i < own.values().size(); ++i) picture.plane(channel)[i] *= own.values()[i];
  return picture;
}

}  // namespace symrig
