// SPDX-License-Identifier: Apache-2.0
#include "projector/dlpc900/saved_state.hpp"

#include "projector/dlp/steps.hpp"

namespace symrig::projector::dlpc900 {
namespace {

using dlp::Run;
using dlp::Steps;

/// In video mode there is no sequence, and the controller refuses to stop one. The mode is written in any
/// case: it reads wrong for a time after a change.
Result<void> stop_patterns(Controller& controller) {
  SYMRIG_TRY(const DisplayMode mode, controller.display_mode());
  if (mode != DisplayMode::video) SYMRIG_CHECK(controller.set_run(Run::stop));
  return controller.set_display_mode(DisplayMode::video);
}

}  // namespace

Result<SavedState> read_state(Controller& controller) {
  SavedState state;
  SYMRIG_TRY(state.mode, controller.display_mode());
  SYMRIG_TRY(state.source, controller.source());
  SYMRIG_TRY(state.receiver, controller.receiver());
  SYMRIG_TRY(state.frame_trigger, controller.trigger_out(1));
  SYMRIG_TRY(state.plane_trigger, controller.trigger_out(2));
  SYMRIG_TRY(state.led_enable, controller.led_enable());
  SYMRIG_TRY(state.led_currents, controller.led_currents());
  return state;
}

Result<void> write_settings(Controller& controller, const SavedState& state) {
  Steps steps;
  steps.take([&] { return stop_patterns(controller); });
  steps.take([&] { return controller.set_source(state.source); });
  steps.take([&] { return controller.set_receiver(state.receiver); });
  steps.take([&] { return controller.set_trigger_out(1, state.frame_trigger); });
  steps.take([&] { return controller.set_trigger_out(2, state.plane_trigger); });
  steps.take([&] { return controller.set_led_currents(state.led_currents); });
  steps.take([&] { return controller.set_led_enable(state.led_enable); });
  return std::move(steps).result();
}

Result<void> restore_state(Controller& controller, const SavedState& state) {
  Steps steps;
  steps.take([&] { return write_settings(controller, state); });
  steps.take([&] {
    return state.mode == DisplayMode::video ? Result<void>() : controller.set_display_mode(state.mode);
  });
  return std::move(steps).result();
}

}  // namespace symrig::projector::dlpc900
