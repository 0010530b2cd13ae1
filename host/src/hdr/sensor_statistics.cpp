// SPDX-License-Identifier: Apache-2.0
#include "hdr/sensor_statistics.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace symrig::hdr {
namespace {

constexpr int kTile = 32;
constexpr int kReach = 8;                // pixels on each side in the smoothing window
constexpr int kRounds = 20;              // rounds of reweighting
constexpr double kFewest = 64;           // smallest number of samples in a tile
constexpr double kOutlier = 6;           // sigmas of a difference; a transient causes more
constexpr double kQuantised = 1.0 / 12;  // the smallest variance, that of rounding

std::size_t index(Grid grid, int row, int col) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.cols) + static_cast<std::size_t>(col);
}

/// Samples of one tile: pixels of both frames that are not flagged and not near saturation.
struct TileSamples {
  std::vector<double> a, b;
};

TileSamples tile_at(Codes a, Codes b, std::span<const std::uint8_t> left_out, Grid grid, int row, int col,
                    double pedestal) {
  TileSamples tile;
  for (int y = row; y < std::min(row + kTile, grid.rows); ++y)
    for (int x = col; x < std::min(col + kTile, grid.cols); ++x) {
      const std::size_t i = index(grid, y, x);
      if (left_out[i] != 0) continue;
      tile.a.push_back(a[i] - pedestal);
      tile.b.push_back(b[i] - pedestal);
    }
  return tile;
}

}  // namespace

PixelMoments moments(std::span<const Codes> frames) {
  const std::size_t pixels = frames.front().size();
  const auto n = static_cast<double>(frames.size());
  PixelMoments result{std::vector<double>(pixels), std::vector<double>(pixels)};
  for (const Codes& frame : frames)
    for (std::size_t i = 0; i < pixels; ++i) result.mean[i] += frame[i] / n;
  if (frames.size() < 2) return result;
  for (const Codes& frame : frames)
    for (std::size_t i = 0; i < pixels; ++i) {
      const double d = frame[i] - result.mean[i];
      result.variance[i] += d * d / (n - 1);
    }
  return result;
}

std::vector<double> smooth(std::span<const double> image, std::span<const std::uint8_t> left_out, Grid grid) {
  // Summed-area table: sums over all pixels above and to the left.
  const auto width = static_cast<std::size_t>(grid.cols) + 1;
  std::vector<double> sum(width * (static_cast<std::size_t>(grid.rows) + 1)), count(sum.size());
  for (int y = 0; y < grid.rows; ++y)
    for (int x = 0; x < grid.cols; ++x) {
      const std::size_t i = index(grid, y, x);
      const std::size_t at = (static_cast<std::size_t>(y) + 1) * width + static_cast<std::size_t>(x) + 1;
      const double used = left_out[i] == 0 ? 1 : 0;
      sum[at] = used * image[i] + sum[at - 1] + sum[at - width] - sum[at - width - 1];
      count[at] = used + count[at - 1] + count[at - width] - count[at - width - 1];
    }
  std::vector<double> result(image.size());
  for (int y = 0; y < grid.rows; ++y)
    for (int x = 0; x < grid.cols; ++x) {
      const auto top = static_cast<std::size_t>(std::max(0, y - kReach)) * width;
      const auto bottom = static_cast<std::size_t>(std::min(grid.rows, y + kReach + 1)) * width;
      const std::size_t left = std::max(0, x - kReach);
      const std::size_t right = std::min(grid.cols, x + kReach + 1);
      const auto box = [&](const std::vector<double>& of) {
        return of[bottom + right] - of[bottom + left] - of[top + right] + of[top + left];
      };
      const double n = box(count);
      result[index(grid, y, x)] = n > 0 ? box(sum) / n : 0;
    }
  return result;
}

std::vector<double> smooth_by_colour(std::span<const double> image, std::span<const std::uint8_t> left_out,
                                     Grid grid) {
  constexpr double kAlike = 0.02;
  std::vector<std::vector<double>> smoothed;
  double least = 1e300, most = -1e300;
  for (int place = 0; place < 4; ++place) {
    std::vector<std::uint8_t> others(left_out.begin(), left_out.end());
    double sum = 0, count = 0;
    for (int y = 0; y < grid.rows; ++y)
      for (int x = 0; x < grid.cols; ++x) {
        const std::size_t i = index(grid, y, x);
        if (y % 2 * 2 + x % 2 != place)
          others[i] = 1;
        else if (left_out[i] == 0)
          sum += image[i], count += 1;
      }
    least = std::min(least, sum / std::max(count, 1.0));
    most = std::max(most, sum / std::max(count, 1.0));
    smoothed.push_back(smooth(image, others, grid));
  }
  if (most - least <= kAlike * most) return smooth(image, left_out, grid);
  std::vector<double> result(image.size());
  for (int y = 0; y < grid.rows; ++y)
    for (int x = 0; x < grid.cols; ++x)
      result[index(grid, y, x)] = smoothed[y % 2 * 2 + x % 2][index(grid, y, x)];
  return result;
}

TransferPoint transfer_point(std::span<const double> a, std::span<const double> b) {
  const auto mean = [](std::span<const double> values) {
    double sum = 0;
    for (const double v : values) sum += v;
    return sum / static_cast<double>(values.size());
  };
  const double first = mean(a), second = mean(b);
  const double noise = robust_sigma(a) + 1;
  // Flicker is a factor on light. Without light the ratio has no meaning.
  const double q = first > 4 * noise && second > 0 ? second / first : 1;
  std::vector<double> difference;
  for (std::size_t i = 0; i < a.size(); ++i) difference.push_back(a[i] - b[i] / q);
  std::vector<double> sorted = difference;
  const double middle = median(sorted);
  const double limit = kOutlier * std::max(robust_sigma(difference), 1.0);
  double sum = 0, squares = 0, count = 0;
  for (const double d : difference) {
    if (std::abs(d - middle) > limit) continue;
    sum += d;
    squares += d * d;
    count += 1;
  }
  if (count < 2) return {};
  const double variance = (squares - sum * sum / count) / (count - 1);
  return {first, variance / (1 + 1 / q), count - 1};
}

TransferLine fit_transfer(std::span<const TransferPoint> points) {
  TransferLine line;
  std::vector<double> expected;
  for (const TransferPoint& p : points) expected.push_back(std::max(p.variance, kQuantised));
  for (int round = 0; round < kRounds; ++round) {
    double w = 0, wx = 0, wxx = 0, wy = 0, wxy = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const TransferPoint& p = points[k];
      const double weight = p.samples / (2 * expected[k] * expected[k]);
      w += weight;
      wx += weight * p.mean;
      wxx += weight * p.mean * p.mean;
      wy += weight * p.variance;
      wxy += weight * p.mean * p.variance;
    }
    const double determinant = w * wxx - wx * wx;
    if (!(determinant > 0)) return {};
    line = {(wxx * wy - wx * wxy) / determinant, (w * wxy - wx * wy) / determinant, wxx / determinant,
            w / determinant};
    // Weights from the points' own variances would favour points that are low by chance.
    for (std::size_t k = 0; k < points.size(); ++k)
      expected[k] = std::max(line.offset + line.slope * points[k].mean, kQuantised);
  }
  return line;
}

void add_transfer_points(Codes a, Codes b, std::span<const std::uint8_t> left_out, Grid grid, double pedestal,
                         double saturation, std::vector<TransferPoint>& points) {
  for (int row = 0; row < grid.rows; row += kTile)
    for (int col = 0; col < grid.cols; col += kTile) {
      const TileSamples tile = tile_at(a, b, left_out, grid, row, col, pedestal);
      if (static_cast<double>(tile.a.size()) < kFewest) continue;
      const double brightest = std::max(*std::max_element(tile.a.begin(), tile.a.end()),
                                        *std::max_element(tile.b.begin(), tile.b.end()));
      if (brightest + pedestal >= saturation) continue;
      const TransferPoint point = transfer_point(tile.a, tile.b);
      if (point.samples >= kFewest / 2) points.push_back(point);
    }
}

namespace {

constexpr double kDefectSigmas = 8;  // a defect differs by more: one false alarm in 10^14 pixels
constexpr double kNoisy = 16;        // times the median variance: four times the noise

}  // namespace

void find_hot(const PixelMoments& dark, std::size_t frames, std::span<std::uint8_t> defects) {
  std::vector<double> means = dark.mean, noises = dark.variance;
  const double middle = median(means);
  const double spread = std::max(robust_sigma(dark.mean), 0.3);
  const double noise = std::max(median(noises), 1.0 / 12);
  // A χ² of few degrees of freedom has a long tail: with fewer frames the threshold is higher.
  const double noisy = kNoisy * (1 + 8 / static_cast<double>(frames - 1));
  for (std::size_t i = 0; i < defects.size(); ++i)
    if (std::abs(dark.mean[i] - middle) > kDefectSigmas * spread || dark.variance[i] > noisy * noise)
      defects[i] = 1;
}

double mean_of(std::span<const double> values, std::span<const std::uint8_t> defects) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (defects[i] == 0) {
      sum += values[i];
      count += 1;
    }
  return count > 0 ? sum / count : 0;
}

double rms_beyond(double squares, double count, double noise) {
  return count > 0 ? std::sqrt(std::max(0.0, squares / count - noise)) : 0;
}

double dsnu_of(const PixelMoments& dark, std::span<const std::uint8_t> defects, std::size_t frames) {
  double sum = 0, squares = 0, noise = 0, count = 0;
  for (std::size_t i = 0; i < dark.mean.size(); ++i) {
    if (defects[i] != 0) continue;
    sum += dark.mean[i];
    squares += dark.mean[i] * dark.mean[i];
    noise += dark.variance[i] / static_cast<double>(frames);
    count += 1;
  }
  if (count < 2) return 0;
  return rms_beyond(squares - sum * sum / count, count - 1, noise / count);
}

void set_noise(Sensor& sensor, const TransferLine& line, int bits, double pedestal, int clipping) {
  sensor.noise = NoiseModel::from_variance_line({line.offset, line.slope, bits, pedestal});
  if (clipping < (1 << bits) - 1) sensor.noise = sensor.noise.clipped_at(clipping);
  sensor.gain_sigma = std::sqrt(line.slope_variance) / line.slope;
  const double read = std::max(line.offset - 1.0 / 12, 1.0 / 12);
  sensor.read_noise_sigma = std::hypot(std::sqrt(line.offset_variance) / (2 * read), sensor.gain_sigma);
}

}  // namespace symrig::hdr
