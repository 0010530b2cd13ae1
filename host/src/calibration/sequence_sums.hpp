// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/sequence_light.hpp"
#include "symrig/base/result.hpp"

namespace symrig::calibration {

struct SumsVerdict {
  Result<void> result;
  bool change = false;  ///< the cause may be a change at some photograph, which includes a movement
};

/// A pattern and its complement add up to white + black, so all sums are one picture. This finds the sums
/// that differ, and their cause: a photograph of another pair; two exchanged photographs; a lamp, a camera or
/// a scene that changed from some photograph on; a wrong white or black.
/// fails: bad_value; the message names the photographs at fault, or all possible ones.
SumsVerdict check_sums(const SequenceLight& light);

}  // namespace symrig::calibration
