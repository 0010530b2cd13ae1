// SPDX-License-Identifier: Apache-2.0
#include "projector/dlpc900/look.hpp"

#include "projector/dlp/look.hpp"

namespace symrig::projector::dlpc900 {

/// The flag of an abort stays after each stop, so it tells nothing about the controller's health.
Result<void> look(Controller& controller, DlpController& found) {
  SYMRIG_CHECK(dlp::look_at_common(controller, found));
  SYMRIG_TRY(const std::uint8_t type, controller.mirrors());
  if (const auto mirrors = mirrors_of(type)) found.mirrors = mirrors->name;
  SYMRIG_TRY(const dlp::Status status, controller.status());
  found.healthy = status.initialized() && !status.sequencer_error();
  SYMRIG_TRY(const DisplayMode mode, controller.display_mode());
  found.patterns = mode != DisplayMode::video;
  found.running = found.patterns && status.sequencing();
  SYMRIG_TRY(const dlp::Signal signal, controller.signal());
  found.signal = dlp::described(signal);
  return {};
}

}  // namespace symrig::projector::dlpc900
