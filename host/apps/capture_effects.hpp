// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/base/result.hpp"

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// Options of capture that change nothing with this algorithm.  fails: bad_argument.
Result<void> check_capture_effects(const CLI::App& command, Algorithm algorithm);

/// Those that change nothing on this rig. Before anything is measured.  fails: bad_argument.
Result<void> check_rig_effects(const CLI::App& command, const Probe& rig);

}  // namespace symrig::apps
