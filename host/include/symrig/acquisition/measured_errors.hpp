// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/acquisition/evaluate.hpp"

namespace symrig {

/// The same errors as evaluate(), each with half of its interval: by delete-one jackknife over the random
/// vectors (frobenius, indirect), by the photographs' noise (all, on a rig). 0 where an error is exact.
/// fails: as evaluate().
Result<ErrorEstimate> measure_errors(const TransportTensor& tensor, const TrueTransport& truth,
                                     const EvaluateOptions& options = {});
Result<ErrorEstimate> measure_errors(const TransportTensor& tensor, Probe& probe,
                                     const EvaluateOptions& options = {}, const Progress& progress = {});

}  // namespace symrig
