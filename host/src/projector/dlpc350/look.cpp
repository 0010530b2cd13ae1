// SPDX-License-Identifier: Apache-2.0
#include "projector/dlpc350/look.hpp"

#include "projector/dlp/look.hpp"

namespace symrig::projector::dlpc350 {

Result<void> look(Controller& controller, DlpController& found) {
  SYMRIG_CHECK(dlp::look_at_common(controller, found));
  SYMRIG_TRY(found.patterns, controller.shows_patterns());
  SYMRIG_TRY(const dlp::Run run, controller.run());
  found.running = found.patterns && run == dlp::Run::start;
  SYMRIG_TRY(const dlp::Signal signal, controller.signal());
  found.signal = dlp::described(signal);
  return {};
}

}  // namespace symrig::projector::dlpc350
