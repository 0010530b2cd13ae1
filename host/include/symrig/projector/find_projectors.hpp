// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/grid.hpp"

#include <array>
#include <string>
#include <vector>

namespace symrig {

/// A size and refresh rate that a display supports.
struct DisplayMode {
  Grid grid;                ///< rows x columns of pixels
  Nanoseconds period{};     ///< of a refresh, computed from the mode's timings
  bool preferred = false;   ///< the display's preferred mode; for a projector its native size
  bool interlaced = false;  ///< each refresh shows only half the rows; never used for patterns
  bool operator==(const DisplayMode&) const = default;
};

/// "1920x1080@60", "1280x720@59.94": the usual form, columns x rows @ refreshes a second.
std::string to_string(const DisplayMode& mode);

/// A connector for a projector, and the display that is connected to it.
struct Display {
  std::string connector;    ///< the kernel's name: "card0-HDMI-A-1"
  std::string driver = {};  ///< of the graphics card: "i915"
  bool connected = false;
  std::string model = {};  ///< from its EDID; empty without an EDID
  std::vector<DisplayMode> modes =
      {};  ///< in the kernel's order, preferred mode first; empty if nothing is connected
  /// Why the card could not be queried. Then `connector` is only the card's name, "card0".
  std::string error = {};
};

/// Lists all connectors of all graphics cards of this computer, in the kernel's order. Changes nothing on any
/// screen. If another program drives a card, the modes are those that it found. Empty if there is no card.
std::vector<Display> find_displays();

/// The video signal at a DLP controller's input.
struct DlpSignal {
  bool locked = false;
  Grid grid;              ///< rows x columns of active pixels
  double refresh_hz = 0;  ///< 0: unknown
};

/// A DLP controller on this computer's USB, and its state if it answered.
struct DlpController {
  std::string path;     ///< "/dev/hidraw0": the key `controller` of a rig file
  std::string product;  ///< "DLPC350", "DLPC900", or as the device says
  std::string serial;   ///< empty: it has none
  std::string error;    ///< why the values below are missing; empty: they are not

  std::string firmware;           ///< "3.0.0"
  std::string mirrors;            ///< "DLP6500"; empty: it does not tell
  bool standby = false;           ///< its mirrors and LEDs are off
  bool parked = false;            ///< its mirrors are parked
  bool healthy = false;           ///< initialized, and no error of the sequencer
  bool patterns = false;          ///< pattern mode; else video
  bool running = false;           ///< a pattern sequence runs
  std::string leds;               ///< "red green blue", or "sequence" if the sequence selects them
  std::array<int, 3> currents{};  ///< registers of the LED currents: red, green, blue, 0 to 255
  DlpSignal signal;
};

/// Lists the controllers and asks each for its state. Changes nothing. Empty in a build without hidapi.
std::vector<DlpController> find_dlp_controllers();

/// The controller at a path. Changes nothing.
/// fails: device_lost (there is none, or it does not answer), device_refused (this build has no hidapi).
Result<DlpController> look_at_dlp_controller(const std::string& path);

}  // namespace symrig
