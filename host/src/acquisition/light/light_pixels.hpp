// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_check.hpp"
#include "acquisition/light/light_fault.hpp"
#include "acquisition/light/light_series.hpp"

#include <optional>

namespace symrig::acquisition {

/// Pixels whose values no light can have: values at which many pixels stand (clipping), pixels that do not
/// depend on the pattern, and less light beside bright pixels than elsewhere (sharpening).
std::optional<LightFault> find_wrong_pixels(const LightSeries& series);

/// Dark rows and columns between lit ones.
/// cost: one photograph for each kind of line that is suspected.  fails: as look.
Result<std::optional<LightFault>> find_dead_lines(const LightSeries& series, const LookAside& look);

}  // namespace symrig::acquisition
