// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_fault.hpp"
#include "acquisition/light/light_order.hpp"
#include "acquisition/light/light_series.hpp"

#include <optional>

namespace symrig::acquisition {

/// Photographs that lack the direct light of their own pattern: they show another pattern, or nothing.
std::optional<LightFault> find_missing_light(const LightSeries& series, const LightMatch& match);

/// Photographs that hold some light of the pattern before.
std::optional<LightFault> find_afterglow(const LightSeries& series, const LightMatch& match);

/// Light that lies beside the pixels that are lit: a camera that looks elsewhere.
std::optional<LightFault> find_shift(const LightSeries& series, const LightMatch& match);

}  // namespace symrig::acquisition
