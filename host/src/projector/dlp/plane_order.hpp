// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::projector::dlp {

/// In which order a controller shows the bits of a picture's words 0x00RRGGBB.
struct PlaneOrder {
  std::array<char, 3> colours{'G', 'R', 'B'};
  bool highest_first = false;  ///< of each colour: from its highest bit

  bool operator==(const PlaneOrder&) const = default;
  /// The bit of a word that is plane 0, 1, … of a picture.
  std::vector<int> bits(int planes) const;
};

/// "GRB", "GRB highest first".
std::string to_string(const PlaneOrder& order);
/// None: not such a text.
std::optional<PlaneOrder> parse_plane_order(std::string_view text);
/// The order whose first planes are these bits. None: no such order.
std::optional<PlaneOrder> order_of_bits(std::span<const int> bits);
/// The key of a rig file with which plane k has the bit that is now plane seen[k]. Empty: no order does that.
std::string order_setting(std::span<const int> bits, std::span<const int> seen);

}  // namespace symrig::projector::dlp
