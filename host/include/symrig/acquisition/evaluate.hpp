// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_operator.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <functional>
#include <span>
#include <vector>

namespace symrig {

/// Truth to be measured against: photograph = T · pattern, signed patterns allowed. [projector grid, 1
/// channel] → [camera grid, channels].
using TrueTransport = std::function<Result<Image<float>>(const Image<float>& pattern)>;

struct EvaluateOptions {
  int probes = 12;  ///< random vectors for frobenius and indirect
  unsigned seed = 7;
  /// Of a camera with pixels of its own: 1 for each sample [channel][pixel] that counts. lit: only those that
  /// see no lit cell; nullptr: all. Empty: pixel i sees cell i.
  std::function<std::vector<char>(const Image<float>* lit)> seen = {};
};

/// fails: size_mismatch, whatever truth fails with.
Result<TransportErrors> evaluate(const TransportOperator& tensor, const TrueTransport& truth,
                                 const EvaluateOptions& options = {});

/// The same on a rig whose truth is unknown, by photographs that the tensor was not made from. A signed
/// pattern is the difference of two photographs. Grey patterns are cut at their median, because a projector's
/// grey levels are not measured. Only pixels that are valid in a photograph count. The photographs' own noise
/// is subtracted: Σ (estimate − photograph)² − Σ Var, over Σ photograph² − Σ Var. An error below that noise
/// is reported as 0 or little more. 4 · probes + 4 photographs. fails: size_mismatch, whatever the probe
/// fails with, interrupted (by progress).
Result<TransportErrors> evaluate(const TransportOperator& tensor, Probe& probe,
                                 const EvaluateOptions& options = {}, const Progress& progress = {});

/// The pictures that errors and reports are made with. values in [0,1], one channel.
Image<float> bar_pattern(Grid grid);
Image<float> natural_pattern(Grid grid, unsigned seed);
Image<float> random_pattern(Grid grid, unsigned seed);

/// The same errors as evaluate(), each with half of its interval; 0 where an error is exact. The interval
/// comes from a delete-one jackknife over the random vectors (frobenius, indirect). On a rig it comes from
/// the photographs' noise (all errors). fails: as evaluate().
Result<ErrorEstimate> measure_errors(const TransportOperator& tensor, const TrueTransport& truth,
                                     const EvaluateOptions& options = {});
Result<ErrorEstimate> measure_errors(const TransportOperator& tensor, Probe& probe,
                                     const EvaluateOptions& options = {}, const Progress& progress = {});

}  // namespace symrig
