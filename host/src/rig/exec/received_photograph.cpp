// SPDX-License-Identifier: Apache-2.0
#include "rig/exec/received_photograph.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include <fmt/format.h>

namespace symrig::rig {
namespace {

std::string place(const Image<float>& image, std::size_t at) {
  const std::int64_t size = image.grid().size(), index = static_cast<std::int64_t>(at);
  const std::int64_t raster = index % size;
  return fmt::format("at row {}, column {}, channel {}", raster / image.grid().cols,
                     raster % image.grid().cols, index / size);
}

template <class T>
void reverse(Image<T>& image, Mirrored mirrored) {
  const auto columns = static_cast<std::size_t>(image.grid().cols);
  for (int channel = 0; channel < image.channels(); ++channel) {
    const std::span<T> plane = image.plane(channel);
    // All pixels backwards exchange the rows and the columns.
    if (mirrored.rows) std::ranges::reverse(plane);
    if (mirrored.rows != mirrored.columns)
      for (std::size_t row = 0; row < plane.size(); row += columns)
        std::ranges::reverse(plane.subspan(row, columns));
  }
}

}  // namespace

void set_right(Radiance& photograph, Mirrored mirrored) {
  if (!mirrored.rows && !mirrored.columns) return;
  reverse(photograph.mean, mirrored);
  reverse(photograph.variance, mirrored);
  reverse(photograph.valid, mirrored);
}

std::optional<std::string> settle(Radiance& photograph) {
  const auto mean = photograph.mean.values(), variance = photograph.variance.values();
  const auto valid = photograph.valid.values();
  for (std::size_t i = 0; i < mean.size(); ++i) {
    if (valid[i] > 1) return fmt::format("valid {}, not 0 or 1, {}", valid[i], place(photograph.mean, i));
    if (valid[i] == 0) mean[i] = variance[i] = 0;
    if (!std::isfinite(mean[i])) return fmt::format("the mean {} {}", mean[i], place(photograph.mean, i));
    if (!std::isfinite(variance[i]) || variance[i] < 0)
      return fmt::format("the variance {} {}", variance[i], place(photograph.mean, i));
  }
  return std::nullopt;
}

}  // namespace symrig::rig
