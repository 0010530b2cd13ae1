// SPDX-License-Identifier: Apache-2.0
#include "projector/dlp/plane_order.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::projector::dlp {
namespace {

constexpr int kBits = 8;  // of each colour

int lowest_bit(char colour) {
  return colour == 'R' ? 16 : colour == 'G' ? 8 : 0;
}

std::vector<PlaneOrder> all_orders() {
  std::vector<PlaneOrder> all;
  std::array<char, 3> colours{'B', 'G', 'R'};
  do {
    all.push_back({colours, false});
    all.push_back({colours, true});
  } while (std::ranges::next_permutation(colours).found);
  return all;
}

}  // namespace

std::vector<int> PlaneOrder::bits(int planes) const {
  std::vector<int> all;
  for (int k = 0; k < planes; ++k) {
    const int place = k % kBits;
    all.push_back(lowest_bit(colours[static_cast<std::size_t>(k / kBits)]) +
                  (highest_first ? kBits - 1 - place : place));
  }
  return all;
}

std::string to_string(const PlaneOrder& order) {
  return fmt::format("{}{}{}{}", order.colours[0], order.colours[1], order.colours[2],
                     order.highest_first ? " highest first" : "");
}

std::optional<PlaneOrder> parse_plane_order(std::string_view text) {
  for (const PlaneOrder& order : all_orders())
    if (to_string(order) == text) return order;
  return std::nullopt;
}

std::optional<PlaneOrder> order_of_bits(std::span<const int> bits) {
  for (const PlaneOrder& order : all_orders())
    if (std::ranges::equal(order.bits(static_cast<int>(bits.size())), bits)) return order;
  return std::nullopt;
}

std::string order_setting(std::span<const int> bits, std::span<const int> seen) {
  std::vector<int> wanted;
  for (const int plane : seen) {
    if (plane < 0 || static_cast<std::size_t>(plane) >= bits.size()) return {};
    wanted.push_back(bits[static_cast<std::size_t>(plane)]);
  }
  const auto order = order_of_bits(wanted);
  return order ? fmt::format("projector.plane_order = \"{}\"", to_string(*order)) : std::string();
}

}  // namespace symrig::projector::dlp
