// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/internal/table_reader.hpp"
#include "symrig/image/grid.hpp"

#include <optional>
#include <string_view>
#include <utility>

namespace symrig::image {

inline constexpr int kLargestSide = 32'768;  // pixels

/// Parses "AxB", both numbers from 1 to kLargestSide.
std::optional<std::pair<int, int>> two_sides(std::string_view text);

// Errors go to the reader's context.

/// A picture's size as on cameras and screens: "columns x rows".
void read_picture_size(base::TableReader& table, std::string_view key, Grid& size);

/// A grid as in the rest of symrig: "rows x columns".
void read_grid(base::TableReader& table, std::string_view key, std::optional<Grid>& grid);

}  // namespace symrig::image
