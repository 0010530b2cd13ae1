// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"

#include <array>
#include <string>
#include <vector>

namespace symrig {

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
