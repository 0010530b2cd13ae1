// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/evaluate.hpp"

#include <string>
#include <vector>

namespace symrig {

/// The true error lies within value ± half_width in this share of cases.
constexpr double kErrorConfidence = 0.95;

/// An error that is not estimated, and why.
struct ErrorNotGiven {
  std::string key;     ///< "indirect", "relight.bar"
  std::string reason;  ///< one sentence without a full stop
};

/// Errors that were estimated from few samples, with how far off the estimates may be.
struct ErrorEstimate {
  TransportErrors value;       ///< NaN where not given
  TransportErrors half_width;  ///< half of the interval (kErrorConfidence); NaN where not given
  std::vector<ErrorNotGiven> not_given = {};
};

}  // namespace symrig
