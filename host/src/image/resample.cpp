// SPDX-License-Identifier: Apache-2.0
#include "symrig/image/image.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig {
namespace {

/// The old pixels under one new pixel, along one axis.
struct AxisOverlap {
  int first = 0;
  std::vector<double> share;  ///< of the new pixel, sums to 1
};

/// New pixel i covers [i, i + 1) · from / to of the old axis.
std::vector<AxisOverlap> overlaps(int from, int to) {
  std::vector<AxisOverlap> result(to);
  const double step = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    const double begin = i * step, end = std::min<double>((i + 1) * step, from);
    AxisOverlap& overlap = result[i];
    overlap.first = static_cast<int>(begin);
    for (int k = overlap.first; k < end && k < from; ++k)
      overlap.share.push_back((std::min<double>(end, k + 1) - std::max<double>(begin, k)) / (end - begin));
  }
  return result;
}

double weighed(const Image<float>& image, int channel, const AxisOverlap& rows, const AxisOverlap& cols) {
  double sum = 0;
  for (std::size_t r = 0; r < rows.share.size(); ++r)
    for (std::size_t c = 0; c < cols.share.size(); ++c)
      sum += rows.share[r] * cols.share[c] *
             static_cast<double>(
                 image.at(rows.first + static_cast<int>(r), cols.first + static_cast<int>(c), channel));
  return sum;
}

}  // namespace

Image<float> resize_nearest(const Image<float>& image, Grid grid) {
  if (image.empty() || !grid.valid()) return {};
  Image<float> resized(grid, image.channels());
  const Grid old = image.grid();
  const auto under = [](int i, int from, int to) {
    return static_cast<int>((2 * std::int64_t{i} + 1) * from / (2 * std::int64_t{to}));
  };
  for (int c = 0; c < image.channels(); ++c)
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col)
        resized.at(row, col, c) =
            image.at(under(row, old.rows, grid.rows), under(col, old.cols, grid.cols), c);
  return resized;
}

Image<float> resize_box(const Image<float>& image, Grid grid) {
  if (image.empty() || !grid.valid()) return {};
  Image<float> resized(grid, image.channels());
  const auto rows = overlaps(image.grid().rows, grid.rows);
  const auto cols = overlaps(image.grid().cols, grid.cols);
  for (int c = 0; c < image.channels(); ++c)
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col)
        resized.at(row, col, c) = static_cast<float>(weighed(image, c, rows[row], cols[col]));
  return resized;
}

Image<float> to_gray(const Image<float>& image) {
  Image<float> gray(image.grid());
  const bool colour = image.channels() == 3;
  const std::vector<float> weights =
      colour ? std::vector<float>{0.2126F, 0.7152F, 0.0722F}
             : std::vector<float>(image.channels(), 1.0F / static_cast<float>(std::max(image.channels(), 1)));
  for (int c = 0; c < image.channels(); ++c)
    std::ranges::transform(gray.plane(0), image.plane(c), gray.plane(0).begin(),
                           [w = weights[c]](float sum, float v) { return sum + w * v; });
  return gray;
}

}  // namespace symrig
