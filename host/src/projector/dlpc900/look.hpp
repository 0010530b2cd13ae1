// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlpc900/controller.hpp"
#include "symrig/projector/dlp_controller.hpp"

namespace symrig::projector::dlpc900 {

/// Reads a controller's state into `found`. Changes nothing. fails: as Controller.
Result<void> look(Controller& controller, DlpController& found);

}  // namespace symrig::projector::dlpc900
