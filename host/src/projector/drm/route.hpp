// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/kms.hpp"
#include "projector/drm/mode.hpp"

namespace symrig::projector::drm {

/// The path of a picture to a projector: plane → CRTC → connector, in one mode.
struct Route {
  std::string connector_name;  // "card0-HDMI-A-1"
  std::uint32_t connector = 0;
  std::uint32_t crtc = 0;
  std::uint32_t plane = 0;                      // the CRTC's primary plane; 0 if the driver shows no planes
  std::vector<std::uint32_t> other_planes;      // that the CRTC shows or could show; to be off
  std::vector<std::uint32_t> other_connectors;  // that the CRTC drives now; to be released
  drmModeModeInfo mode{};

  Grid grid() const { return describe(mode).grid; }
  Nanoseconds period() const { return describe(mode).period; }
};

/// A connector of an open card.
struct FoundConnector {
  std::string card;
  std::unique_ptr<Kms> kms;
  Connector connector;
};

/// Finds a connector by the kernel's name, "card0-HDMI-A-1", or without the card if only one matches. "": the
/// only connected one.
/// fails: unknown_name (lists the connectors), bad_argument (several), device_lost (nothing connected, no
/// card, or no permission).
Result<FoundConnector> find_connector(Cards& cards, const std::string& wanted);

/// Chooses a CRTC and a primary plane for a connector: those that drive it already, else free ones, else any.
/// fails: as choose_mode; device_refused (the card has none left), device_lost.
Result<Route> choose_route(Kms& kms, const FoundConnector& found, const ModeRequest& request);

/// The error for a call that the kernel refused: `what` failed on connector `name`.
Error refusal(const std::string& name, const std::string& what, Errno error);

}  // namespace symrig::projector::drm
