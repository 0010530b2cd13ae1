// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/view_layout.hpp"

#include <cstdint>
#include <string_view>
#include <vector>

namespace symrig {

/// The order in which a block tree over several views is cut.
enum class SplitOrder : std::uint8_t {
  flat,         ///< the whole picture, without regard to views [Garg06 §5.1]
  views_first,  ///< down to single views, then each view like a separate picture
  views_last,   ///< all views in the same way down to one pixel of the tile, then the views
  all_at_once,  ///< rows with rows of views, then columns with columns of views: two levels are one level of
                ///< the 8th-order tensor, whose blocks have 16 children [Garg06 §5.1]
  compensated,  ///< like views_last, but by the point on the surface that a pixel sees instead of its place
                ///< in the tile: pixels of all views that see one point share a block at every size
};
/// "flat", "views-first", "views-last", "all-at-once", "compensated".
std::string_view name(SplitOrder order);
/// All orders, for help and completion.
std::vector<std::string_view> split_order_names();
/// fails: unknown_name.
Result<SplitOrder> parse_split_order(std::string_view text);

/// How a grid of pixels is cut into blocks.
struct Split {
  ViewLayout views;
  SplitOrder order = SplitOrder::flat;
  /// For compensated: the point that each pixel of the grid sees, as row (channel 0) and column (channel 1),
  /// in coordinates that all views share. units: pixels of a view, pixel centres at + ½. Empty for other
  /// orders.
  Image<float> surface;
};

}  // namespace symrig
