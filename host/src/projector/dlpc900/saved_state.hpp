// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlpc900/controller.hpp"

namespace symrig::projector::dlpc900 {

/// The settings of a controller that a video sequence changes, as far as the controller tells them. It does
/// not tell its pattern table, nor whether an earlier sequence was started.
struct SavedState {
  DisplayMode mode = DisplayMode::video;
  std::uint8_t source = 0;
  std::uint8_t receiver = 0;
  TriggerOut frame_trigger, plane_trigger;  ///< TRIG_OUT_1, TRIG_OUT_2
  dlp::LedEnable led_enable;
  dlp::LedCurrents led_currents{};
  bool operator==(const SavedState&) const = default;
};

/// Changes nothing. fails: as Controller.
Result<SavedState> read_state(Controller& controller);

/// Stops the sequence if one can run, goes to video mode, and writes the settings but the mode. The LEDs come
/// last: while the rest changes, no LED is brighter than it was. A setting that cannot be written does not
/// keep the others from being written. fails: with the first error, as Controller.
Result<void> write_settings(Controller& controller, const SavedState& state);

/// write_settings(), then the mode. Its patterns stand still. fails: as write_settings().
Result<void> restore_state(Controller& controller, const SavedState& state);

}  // namespace symrig::projector::dlpc900
