// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/radiance.hpp"

#include <span>

namespace symrig::calibration {

/// The sum of photographs times `share`, with its variance. Valid where all of them are.
/// needs: one photograph at least; all of one size.
Radiance scaled_sum(std::span<const Radiance> photographs, float share);

}  // namespace symrig::calibration
