// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/find_displays.hpp"

#include "projector/drm/mode.hpp"

namespace symrig {
namespace projector::drm {
namespace {

std::string model_of(Kms& kms, std::uint32_t connector) {
  for (const Property& property : kms.properties(connector, Kind::connector).value)
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
