// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/find_displays.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace symrig::projector::drm {
namespace {

constexpr std::size_t kBlock = 128;
constexpr std::array<std::uint8_t, 8> kHead{0x00, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x00};
constexpr std::size_t kFirstDescriptor = 54, kDescriptor = 18, kDescriptors = 4;
constexpr std::array<std::uint8_t, 5> kProductName{0x00, 0x00, 0x00, 0xFC, 0x00};
constexpr char kEnd = '\n';

bool begins_with(std::span<const std::byte> bytes, std::span<const std::uint8_t> head) {
  return std::equal(head.begin(), head.end(), bytes.begin(),
                    [](std::uint8_t a, std::byte b) { return a == std::to_integer<std::uint8_t>(b); });
}

/// The printable characters up to the end mark, without trailing blanks.
std::string text(std::span<const std::byte> bytes) {
  std::string name;
  for (const std::byte byte : bytes) {
    const char c = std::to_integer<char>(byte);
    if (c == kEnd) break;
    name += c >= ' ' && c <= '~' ? c : '?';
  }
  name.erase(name.find_last_not_of(' ') + 1);
  return name;
}

}  // namespace

std::string display_name(std::span<const std::byte> edid) {
  if (edid.size() < kBlock || !begins_with(edid, kHead)) return {};
  for (std::size_t k = 0; k < kDescriptors; ++k) {
    const auto descriptor = edid.subspan(kFirstDescriptor + k * kDescriptor, kDescriptor);
    if (begins_with(descriptor, kProductName)) return text(descriptor.subspan(kProductName.size()));
  }
  return {};
}

}  // namespace symrig::projector::drm
