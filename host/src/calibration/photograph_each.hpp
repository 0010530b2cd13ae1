// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/image/image.hpp"

#include <span>
#include <string>
#include <vector>

namespace symrig::calibration {

/// Shows patterns one by one, with a step of progress before each. step: what is measured, for the progress.
/// fails: interrupted (by progress); as the probe.
Result<std::vector<Radiance>> photograph_each(Probe& probe, std::span<const Pattern> patterns,
                                              const std::string& step, const Progress& progress);

/// The sum of photographs times `share`, with its variance. Valid where all of them are.
/// needs: one photograph at least; all of one size.
Radiance scaled_sum(std::span<const Radiance> photographs, float share);

}  // namespace symrig::calibration
