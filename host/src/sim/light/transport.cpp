// SPDX-License-Identifier: Apache-2.0

#include "sim/light/transport.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace symrig::sim {

namespace {

void blur_along_row(std::span<float> row, float a) {
  float before = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const float here = row[i];
    const float after = i + 1 < row.size() ? row[i + 1] : 0.F;
    row[i] = (1 - 2 * a) * here + a * (before + after);
    before = here;
  }
}

void blur_across_rows(Grid grid, std::span<float> image, float a) {
  const std::size_t cols = grid.cols;
  std::vector<float> before(cols, 0.F);
  const std::vector<float> dark(cols, 0.F);
  for (int row = 0; row < grid.rows; ++row) {
    float* here = &image[static_cast<std::size_t>(row) * cols];
    const float* after = row + 1 < grid.rows ? here + cols : dark.data();
    for (std::size_t i = 0; i < cols; ++i) {
      const float value = here[i];
      here[i] = (1 - 2 * a) * value + a * (before[i] + after[i]);
      before[i] = value;
    }
  }
}

}  // namespace

void blur_3tap(Grid grid, float a, std::span<float> image) {
  const std::size_t cols = grid.cols;
  for (std::size_t row = 0; row < static_cast<std::size_t>(grid.rows); ++row)
    blur_along_row(image.subspan(row * cols, cols), a);
  blur_across_rows(grid, image, a);
}

namespace {

constexpr double kReachSigmas = 5;  // the Gaussian is 4e-6 of its peak there

std::vector<float> gaussian_kernel(double sigma, int limit) {
  const int reach = std::min(limit, static_cast<int>(std::ceil(kReachSigmas * sigma)));
  std::vector<double> value;
  value.reserve(static_cast<std::size_t>(reach) + 1);
  double sum = 0;
  for (int d = 0; d <= reach; ++d) {
    value.push_back(std::exp(-0.5 * d * d / (sigma * sigma)));
    sum += (d == 0 ? 1 : 2) * value.back();
  }
  std::vector<float> kernel;
  kernel.reserve(value.size());
  for (const double v : value) kernel.push_back(static_cast<float>(v / sum));
  return kernel;
}

/// target += weight · source, element-wise.
void add_scaled(float weight, const float* source, float* target, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) target[i] += weight * source[i];
}

/// Rows of equal length.
struct Rows {
  Rows(int count_, std::size_t length_)
      : count(count_), length(length_), data(static_cast<std::size_t>(count_) * length_, 0.F) {}
  float* row(int i) { return &data[static_cast<std::size_t>(i) * length]; }
  const float* row(int i) const { return &data[static_cast<std::size_t>(i) * length]; }

  int count;
  std::size_t length;
  std::vector<float> data;
};

/// Wᵀ: splits every sample between its two lattice neighbours.
Rows restrict_rows(const AxisBlur& axis, const Rows& in) {
  Rows out(axis.nodes, in.length);
  for (int i = 0; i < axis.n; ++i) {
    const std::size_t at = i;
    add_scaled(1 - axis.share[at], in.row(i), out.row(axis.node[at]), in.length);
    if (axis.share[at] > 0) add_scaled(axis.share[at], in.row(i), out.row(axis.node[at] + 1), in.length);
  }
  return out;
}

Rows blur_rows(const AxisBlur& axis, const Rows& in) {
  Rows out(in.count, in.length);
  for (int i = 0; i < in.count; ++i) {
    const int begin = std::max(0, i - axis.reach());
    const int end = std::min(in.count, i + axis.reach() + 1);
    for (int j = begin; j < end; ++j)
      add_scaled(axis.kernel[std::abs(i - j)], in.row(j), out.row(i), in.length);
  }
  return out;
}

/// W / step.
Rows prolong_rows(const AxisBlur& axis, const Rows& in) {
  Rows out(axis.n, in.length);
  const float scale = 1 / static_cast<float>(axis.step);
  for (int i = 0; i < axis.n; ++i) {
    const std::size_t at = i;
    add_scaled(scale * (1 - axis.share[at]), in.row(axis.node[at]), out.row(i), in.length);
    if (axis.share[at] > 0)
      add_scaled(scale * axis.share[at], in.row(axis.node[at] + 1), out.row(i), in.length);
  }
  return out;
}

Rows blur_axis(const AxisBlur& axis, const Rows& in) {
  return axis.step == 1 ? blur_rows(axis, in) : prolong_rows(axis, blur_rows(axis, restrict_rows(axis, in)));
}

Rows transposed(const Rows& in) {
  Rows out(static_cast<int>(in.length), static_cast<std::size_t>(in.count));
  for (int i = 0; i < in.count; ++i)
    for (int j = 0; j < out.count; ++j) out.row(j)[i] = in.row(i)[j];
  return out;
}

}  // namespace

AxisBlur::AxisBlur(int n_, double sigma)
    : n(n_), step(std::max(1, static_cast<int>(2 * sigma / kFineWidth))), nodes((n_ + step - 1) / step) {
  kernel = gaussian_kernel(sigma / step, nodes);
  for (int i = 0; i < n; ++i) {
    const double x = std::clamp((i + 0.5) / step - 0.5, 0.0, nodes - 1.0);
    const int left = std::min(static_cast<int>(x), std::max(0, nodes - 2));
    node.push_back(left);
    share.push_back(static_cast<float>(x - left));
  }
}

GaussianBlur::GaussianBlur(Grid grid, double sigma)
    : grid_(grid), down_(grid.rows, sigma), across_(grid.cols, sigma) {}

void GaussianBlur::add(float weight, std::span<const float> in, std::span<float> out) const {
  Rows picture(grid_.rows, static_cast<std::size_t>(grid_.cols));
  std::copy(in.begin(), in.end(), picture.data.begin());
  const Rows down = blur_axis(down_, picture);
  const Rows both = transposed(blur_axis(across_, transposed(down)));
  add_scaled(weight, both.data.data(), out.data(), out.size());
}

}  // namespace symrig::sim
