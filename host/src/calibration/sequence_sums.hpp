// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/sequence_light.hpp"
#include "symrig/base/result.hpp"

namespace symrig::calibration {

struct SumsVerdict {
  Result<void> result;
  bool change = false;  ///< what is wrong may come of a change at some photograph: a movement, too
};

/// A pattern and its complement add up to white + black, so that all sums are one picture. Looks which sums
/// are, and what explains the others: a photograph that is not of its pair, two that are exchanged, a lamp, a
/// camera or a scene that changed from some photograph on, a white or a black that is none. fails: bad_value;
/// the message names the photographs that the sums single out, or all that they leave.
SumsVerdict check_sums(const SequenceLight& light);

}  // namespace symrig::calibration
