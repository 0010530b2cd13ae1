// SPDX-License-Identifier: Apache-2.0

#include "symrig/projector/internal/drm.hpp"

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

namespace symrig {
namespace projector::drm {
namespace {

std::string model_of(Kms& kms, std::uint32_t connector) {
  for (const Property& property : kms.properties(connector, ObjectKind::connector).value)
    if (property.name == "EDID" && property.value != 0)
      return display_name(kms.blob(static_cast<std::uint32_t>(property.value)).value);
  return {};
}

Display display_at(Kms& kms, const std::string& card, const Connector& connector) {
  Display display;
  display.connector = card + "-" + connector.name;
  display.driver = kms.driver();
  display.connected = connector.connected;
  display.model = model_of(kms, connector.id);
  for (const auto& mode : connector.modes) display.modes.push_back(describe(mode));
  return display;
}

}  // namespace

std::vector<Display> find_displays(Cards& cards) {
  std::vector<Display> displays;
  for (const std::string& card : cards.names()) {
    const auto kms = cards.open(card);
    if (!kms && kms.error().code == ErrorCode::device_refused) continue;  // a card without display outputs
    if (!kms) {
      displays.push_back({.connector = card, .error = kms.error().line()});
      continue;
    }
    // The first program to open an idle card becomes its master. Only a master may probe its connectors.
    const auto resources = (*kms)->resources();
    for (const std::uint32_t id : resources.value.connectors)
      if (const auto connector = (*kms)->connector(id, true))
        displays.push_back(display_at(**kms, card, connector.value));
    (*kms)->drop_master();
  }
  return displays;
}

}  // namespace projector::drm

std::vector<Display> find_displays() {
  return projector::drm::find_displays(*projector::drm::machine_cards());
}

}  // namespace symrig
