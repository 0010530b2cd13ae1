// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/projector/find_projectors.hpp"
#include "symrig/projector/internal/kms.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <xf86drmMode.h>

namespace symrig::projector::drm {

/// The mode that the user asks for.
struct ModeRequest {
  std::optional<Grid> grid;    // none: the preferred mode
  std::optional<double> rate;  // refreshes a second; none: any
  bool computed = false;       // computed timings, whatever the display lists
};

/// "", "1920x1080", "1920x1080@60", "1280x720@59.94", "912x1140R@60". R: computed timings with reduced
/// blanking, at 60 if no rate is given.
/// fails: bad_argument.
Result<ModeRequest> parse_mode(const std::string& text);

DisplayMode describe(const drmModeModeInfo& mode);

/// Returns a computed mode, or the first mode of this size in the kernel's order (preferred first, then fast
/// before slow). With a rate: the mode with the nearest rate, at most 0.5 Hz away. Skips interlaced and
/// double-scan modes, because their lines differ from the projector's.
/// fails: unknown_name (lists the modes), device_lost (no modes).
Result<drmModeModeInfo> choose_mode(std::span<const drmModeModeInfo> modes, const ModeRequest& request,
                                    const std::string& connector);

/// Timings for a size and rate that the display does not list: VESA Coordinated Video Timings 1.2, reduced
/// blanking (version 1). The pixel clock is a multiple of 0.25 MHz, rounded down, so the rate may be slightly
/// low. rate: refreshes a second, positive.
drmModeModeInfo reduced_blanking_mode(Grid grid, double rate);

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

/// A property that can change pictures on their way from memory to light, and its identity value.
struct IdentityValue {
  Setting setting;
  Property property;     // its state before
  std::string wanted;    // the value's name: "Full", "0"
  bool must = false;     // true: without it pixels would be wrong, which is an error; false: a warning
  bool possible = true;  // the property has this value and can be set
};

/// The identity values for all known properties of one object.
/// Documentation: Linux, Documentation/gpu/drm-kms.rst (standard properties); the driver's sources for its
/// own properties.
std::vector<IdentityValue> identity_values(std::uint32_t object, ObjectKind kind,
                                           std::span<const Property> properties);

/// The identity table: v(i) = 65535·i / (size − 1), rounded.
Gamma straight_gamma(int size);

/// "connector property 'Broadcast RGB' is 'Limited 16:235' and cannot be 'Full'"
std::string complaint(const IdentityValue& identity);

/// symrig::find_displays() for these cards.
std::vector<Display> find_displays(Cards& cards);

/// The display's name from its EDID (VESA E-EDID 1.4 §3.10.3, display product name descriptor). Empty if the
/// EDID has no name or is invalid.
std::string display_name(std::span<const std::byte> edid);

/// Reads the kernel's flip events from a card's file. One read may return several events.
class FlipEvents {
 public:
  /// As Kms::next_flip().
  KernelAnswer<FlipEvent> next(int card, Nanoseconds patience);

 private:
  Errno read_some(int card);

  std::deque<FlipEvent> waiting_;
};

/// true: the message reports that a display of `card` ("card0") was connected or disconnected. Messages about
/// a property, or about a connector other than `connector`, do not count. text: a uevent from the kernel,
/// lines that end with a zero byte (Documentation/ABI: sysfs uevents; drm_sysfs_hotplug_event).
bool is_hotplug_message(std::string_view text, const std::string& card, std::uint32_t connector);

/// Receives the kernel's uevents. Without permission it never receives any.
class HotplugListener {
 public:
  explicit HotplugListener(std::string card);
  /// true: a hot-plug message has come since the last call.
  bool received(std::uint32_t connector);

 private:
  std::string card_;
  Fd socket_;
};

}  // namespace symrig::projector::drm
