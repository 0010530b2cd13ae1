// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/table_reader.hpp"
#include "symrig/image/grid.hpp"

#include <optional>
#include <string_view>
#include <utility>

namespace symrig::image {

inline constexpr int kLargestSide = 32'768;  // pixels

/// "AxB", both 1 to kLargestSide.
std::optional<std::pair<int, int>> two_sides(std::string_view text);

// What is wrong goes to the reader's context.

/// A picture's size as makers of cameras and screens write it: "columns x rows".
void read_picture_size(base::TableReader& table, std::string_view key, Grid& size);

/// A grid as everywhere else in symrig: "rows x columns".
void read_grid(base::TableReader& table, std::string_view key, std::optional<Grid>& grid);

}  // namespace symrig::image
