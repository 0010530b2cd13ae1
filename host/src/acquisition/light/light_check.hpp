// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_fault.hpp"
#include "acquisition/light/light_order.hpp"
#include "acquisition/light/light_series.hpp"
#include "symrig/base/result.hpp"

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// Takes further photographs, which are no part of the capture (CaptureOptions::look_aside). No photographs:
/// the rig cannot be asked.
using LookAside = std::function<Result<std::vector<Radiance>>(std::span<const Pattern>)>;

/// Whether the first photographs of a capture can be those of a rig: light adds up, is never negative, and
/// lies where the projector shows it. The tests go from the most general to the most special one; each later
/// one relies on what the earlier ones have found in order.
/// look: asked only if something is wrong, to find out what; may be empty.
/// cost: no photograph if all is well, else at most six.
/// fails: wrong_light (LightFault); as look.
Result<void> check_light(const LightSeries& series, const LookAside& look);

/// Photographs that belong to other patterns: late, early, or inverted; else as cause_of_turn().
LightCause cause_of_order(const LightOrder& order);
/// A camera whose picture is mirrored or turned, and where that is set right.
LightCause cause_of_turn(Turn turn);

/// No light in as many photographs, each of one pixel. below_black: all together are below 0.
LightFault no_light(std::size_t photographs, bool below_black);

}  // namespace symrig::acquisition
