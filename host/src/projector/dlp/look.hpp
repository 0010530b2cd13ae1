// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlp/controller.hpp"
#include "projector/dlp/signal.hpp"
#include "symrig/projector/dlp_controller.hpp"

namespace symrig::projector::dlp {

/// Reads into `found` what every controller tells. Changes nothing. fails: as Controller.
Result<void> look_at_common(Controller& controller, DlpController& found);

inline DlpSignal described(const Signal& signal) {
  return {signal.locked, {signal.rows, signal.cols}, signal.refresh_hz};
}

}  // namespace symrig::projector::dlp
