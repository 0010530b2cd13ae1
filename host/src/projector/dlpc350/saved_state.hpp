// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlpc350/controller.hpp"

namespace symrig::projector::dlpc350 {

/// All settings of a controller that a video sequence changes.
struct SavedState {
  bool shows_patterns = false;
  std::uint8_t source = 0;
  std::uint8_t pattern_source = 0;
  std::uint8_t trigger_mode = 0;
  bool inverted = false;
  Times times;
  Counts counts;
  std::vector<TableEntry> table;
  TriggerOut plane_trigger, frame_trigger;  ///< TRIG_OUT_1, TRIG_OUT_2
  dlp::LedEnable led_enable;
  dlp::LedCurrents led_currents{};
  dlp::Run run = dlp::Run::stop;
  bool operator==(const SavedState&) const = default;
};

/// Reads the state and changes nothing but the table's door. fails: as Controller.
Result<SavedState> read_state(Controller& controller);

/// Stops the sequence, writes what differs, and starts the sequence again if one ran. A setting that cannot
/// be written does not keep the others from being written. fails: with the first error, as Controller.
Result<void> restore_state(Controller& controller, const SavedState& state);

}  // namespace symrig::projector::dlpc350
