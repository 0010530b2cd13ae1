// SPDX-License-Identifier: Apache-2.0
#include "projector/dlpc350/saved_state.hpp"

#include "projector/dlp/steps.hpp"

#include <utility>

namespace symrig::projector::dlpc350 {
namespace {

using dlp::Run;
using dlp::Steps;

/// Writes everything that a stopped sequence may change.
Result<void> write_sequence(Controller& controller, const SavedState& state) {
  Steps steps;
  steps.take([&] { return controller.set_source(state.source); });
  steps.take([&] { return controller.set_pattern_source(state.pattern_source); });
  steps.take([&] { return controller.set_trigger_mode(state.trigger_mode); });
  steps.take([&] { return controller.set_inverted(state.inverted); });
  steps.take([&] { return controller.set_times(state.times); });
  steps.take([&] { return controller.set_counts(state.counts); });
  steps.take([&] { return controller.set_table(state.table); });
  steps.take([&] { return controller.set_trigger_out(1, state.plane_trigger); });
  steps.take([&] { return controller.set_trigger_out(2, state.frame_trigger); });
  return std::move(steps).result();
}

/// A controller runs a sequence only after it has checked it.
Result<void> run_again(Controller& controller, const SavedState& state) {
  if (state.run == Run::stop) return {};
  SYMRIG_TRY(const Validation validation, controller.validate());
  if (!validation.ok())
    return Error{ErrorCode::device_refused,
                 controller.name() + " does not take its earlier sequence again: " + to_string(validation),
                 "start its sequence with the program that made it"};
  return controller.set_run(state.run);
}

}  // namespace

Result<SavedState> read_state(Controller& controller) {
  SavedState state;
  SYMRIG_TRY(state.shows_patterns, controller.shows_patterns());
  SYMRIG_TRY(state.source, controller.source());
  SYMRIG_TRY(state.pattern_source, controller.pattern_source());
  SYMRIG_TRY(state.trigger_mode, controller.trigger_mode());
  SYMRIG_TRY(state.inverted, controller.inverted());
  SYMRIG_TRY(state.times, controller.times());
  SYMRIG_TRY(state.counts, controller.counts());
  SYMRIG_TRY(state.table, controller.table(state.counts.entries));
  SYMRIG_TRY(state.plane_trigger, controller.trigger_out(1));
  SYMRIG_TRY(state.frame_trigger, controller.trigger_out(2));
  SYMRIG_TRY(state.led_enable, controller.led_enable());
  SYMRIG_TRY(state.led_currents, controller.led_currents());
  SYMRIG_TRY(state.run, controller.run());
  return state;
}

/// The LEDs go last into their earlier state: while the sequence changes, no LED is brighter than it was.
Result<void> restore_state(Controller& controller, const SavedState& state) {
  Steps steps;
  steps.take([&] { return controller.set_run(Run::stop); });
  steps.take([&] { return write_sequence(controller, state); });
  steps.take([&] { return controller.show_patterns(state.shows_patterns); });
  steps.take([&] { return controller.set_led_currents(state.led_currents); });
  steps.take([&] { return controller.set_led_enable(state.led_enable); });
  steps.take([&] { return run_again(controller, state); });
  return std::move(steps).result();
}

}  // namespace symrig::projector::dlpc350
