// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/image/grid.hpp"

#include <string>
#include <vector>

namespace symrig {

/// A size and rate in which a display can be driven.
struct DisplayMode {
  Grid grid;                ///< rows x columns of pixels
  Nanoseconds period{};     ///< of a refresh, from the mode's timings
  bool preferred = false;   ///< the display's own wish: on a projector its native size
  bool interlaced = false;  ///< every refresh shows half the rows: never used for patterns
  bool operator==(const DisplayMode&) const = default;
};

/// "1920x1080@60", "1280x720@59.94": columns x rows @ refreshes a second, as people name modes.
std::string to_string(const DisplayMode& mode);

/// A place where a projector can be plugged in, and what is there.
struct Display {
  std::string connector;    ///< as the kernel calls it: "card0-HDMI-A-1"
  std::string driver = {};  ///< of the card: "i915"
  bool connected = false;
  std::string model = {};  ///< from its EDID; empty if it has none
  std::vector<DisplayMode> modes =
      {};  ///< the kernel's order: preferred first; empty if nothing is connected
  /// Why the card could not be asked; connector is then the card alone, "card0".
  std::string error = {};
};

/// All connectors of all cards of this machine, in the kernel's order. Changes nothing on any screen. While
/// another program drives a card, its modes are those that the program found. A machine without a card has
/// none.
std::vector<Display> find_displays();

}  // namespace symrig
