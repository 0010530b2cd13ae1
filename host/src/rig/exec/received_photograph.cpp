// SPDX-License-Identifier: Apache-2.0
#include "rig/exec/received_photograph.hpp"

#include <cmath>

#include <fmt/format.h>

namespace symrig::rig {
namespace {

std::string place(const Image<float>& image, std::size_t at) {
  const std::int64_t size = image.grid().size(), index = static_cast<std::int64_t>(at);
  const std::int64_t raster = index % size;
  return fmt::format("at row {}, column {}, channel {}", raster / image.grid().cols,
                     raster % image.grid().cols, index / size);
}

}  // namespace

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
