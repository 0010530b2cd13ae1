// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"

#include <span>
#include <string>
#include <vector>

namespace symrig::calibration {

/// Shows patterns one by one, with a step of progress before each. step: what is measured, for the progress.
/// fails: interrupted (by progress); as the probe.
Result<std::vector<Radiance>> photograph_each(Probe& probe, std::span<const Pattern> patterns,
                                              const std::string& step, const Progress& progress);

}  // namespace symrig::calibration
