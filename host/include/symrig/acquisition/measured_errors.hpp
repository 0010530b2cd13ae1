// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/acquisition/evaluate.hpp"

namespace symrig {

/// The same errors as evaluate(), each with half of its interval; 0 where an error is exact. The interval
/// comes from a delete-one jackknife over the random vectors (frobenius, indirect). On a rig it comes from
/// the photographs' noise (all errors). fails: as evaluate().
Result<ErrorEstimate> measure_errors(const TransportOperator& tensor, const TrueTransport& truth,
                                     const EvaluateOptions& options = {});
Result<ErrorEstimate> measure_errors(const TransportOperator& tensor, Probe& probe,
                                     const EvaluateOptions& options = {}, const Progress& progress = {});

}  // namespace symrig
