// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/grid.hpp"

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

}  // namespace symrig
