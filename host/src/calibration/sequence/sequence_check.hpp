// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/pixel_map.hpp"

namespace symrig::calibration {

/// Looks for faults of a sequence before anything is decoded. Its message names the photographs at fault, or
/// up to three possible causes, each with what was measured of it. It finds:
/// - a saturated white: over 2 % of the pixels that the projector lights have the largest code;
/// - sums of pairs that are not one picture (check_sums);
/// - a camera or scene that moved by more than a quarter of a pixel;
/// - stripes that contradict their order (judge_order);
/// - positions outside the projector.
/// It uses only pixels that the projector lights, however few they are, and compares them with the noise of
/// the photographs. It does not use photographs of the held-out pair, unless something is wrong.
/// fails: bad_value.
Result<void> check_sequence(const CodePhotographs& photographs, const DecodeOptions& options = {});

/// The causes of a finding that a sequence contradicts itself: another order of its photographs that fits;
/// then what has changed their light. Else the finding. No finding: only another order is looked for, for
/// photographs that cannot be judged in theirs. definite: the finding names its own cause, so others must
/// explain everything.
Result<void> explain_contradiction(const CodePhotographs& photographs, const Result<void>& finding,
                                   bool definite);

/// Light that a fit needs to be right, though a map does not: it refuses photographs whose light changes by
/// more than 4 %, a curved response, and sharpening.  fails: bad_value.
Result<void> check_light(const CodePhotographs& photographs, const std::optional<int>& held_out);

}  // namespace symrig::calibration
