// SPDX-License-Identifier: Apache-2.0
#include "projector/bit_planes.hpp"

#include <cmath>

#include <fmt/format.h>

namespace symrig::projector {
namespace {

Result<void> check_pattern_grid(const Pattern& pattern, Grid grid, std::size_t number) {
  if (pattern.grid() == grid && pattern.channels() == 1) return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("pattern {} is {} with {} channels, but the projector shows {} with 1", number,
                           to_string(pattern.grid()), pattern.channels(), to_string(grid)),
               "give patterns on the projector's grid"};
}

Error bad_pixel(const Pattern& pattern, std::size_t number, std::size_t at, std::string_view legal) {
  const int cols = pattern.grid().cols, pixel = static_cast<int>(at);
  return {ErrorCode::bad_value,
          fmt::format("pattern {} is {} at row {}, column {}", number, pattern.values()[at], pixel / cols,
                      pixel % cols),
          std::string(legal)};
}

Result<void> check_binary(const Pattern& pattern, std::size_t number) {
  const auto values = pattern.values();
  for (std::size_t i = 0; i < values.size(); ++i)
    if (values[i] != 0 && values[i] != 1)
      return bad_pixel(pattern, number, i, "a bit plane shows only 0 and 1");
  return {};
}

void add_plane(Image<std::uint32_t>& picture, const Pattern& pattern, int bit) {
  const std::uint32_t mask = 1U << static_cast<unsigned>(bit);
  for (std::size_t i = 0; i < picture.values().size(); ++i)
    if (pattern.values()[i] != 0) picture.values()[i] |= mask;
}

}  // namespace

Result<std::vector<Image<std::uint32_t>>> pack_planes(std::span<const Pattern> patterns,
                                                      std::span<const PlanePlan> plans, Grid grid,
                                                      std::span<const int> bits) {
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    SYMRIG_CHECK(check_pattern_grid(patterns[k], grid, k));
    SYMRIG_CHECK(check_binary(patterns[k], k));
  }
  std::vector<Image<std::uint32_t>> pictures;
  for (const PlanePlan& plan : plans) {
    Image<std::uint32_t> picture(grid);
    for (std::size_t k = 0; k < plan.size(); ++k) {
      if (plan[k] == kBlackPlane) continue;
      if (k >= bits.size() || plan[k] < 0 || static_cast<std::size_t>(plan[k]) >= patterns.size())
        return Error{ErrorCode::bad_argument,
                     fmt::format("plane {} of {} shall show pattern {} of {}", k, bits.size(), plan[k],
                                 patterns.size()),
                     "plan planes and patterns that exist"};
      add_plane(picture, patterns[static_cast<std::size_t>(plan[k])], bits[k]);
    }
    pictures.push_back(std::move(picture));
  }
  return pictures;
}

Result<std::vector<Image<std::uint32_t>>> spread_over_planes(std::span<const Pattern> patterns, Grid grid,
                                                             std::span<const int> bits) {
  std::vector<std::uint32_t> word_of{0};  // by the number of bright planes
  for (const int bit : bits) word_of.push_back(word_of.back() | 1U << static_cast<unsigned>(bit));
  std::vector<Image<std::uint32_t>> pictures;
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    SYMRIG_CHECK(check_pattern_grid(patterns[k], grid, k));
    Image<std::uint32_t> picture(grid);
    const auto values = patterns[k].values();
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!(values[i] >= 0 && values[i] <= 1)) return bad_pixel(patterns[k], k, i, "give values from 0 to 1");
      const auto bright = std::lround(static_cast<double>(values[i]) * static_cast<double>(bits.size()));
      picture.values()[i] = word_of[static_cast<std::size_t>(bright)];
    }
    pictures.push_back(std::move(picture));
  }
  return pictures;
}

}  // namespace symrig::projector
