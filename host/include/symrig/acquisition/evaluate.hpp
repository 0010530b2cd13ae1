// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_operator.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <functional>
#include <span>

namespace symrig {

/// Truth to be measured against: photograph = T · pattern, signed patterns allowed. [projector grid, 1
/// channel] → [camera grid, channels].
using TrueTransport = std::function<Result<Image<float>>(const Image<float>& pattern)>;

/// The errors of `symrig evaluate` (docs/command-line.md), each relative: ‖estimate − truth‖ / ‖truth‖ over
/// all channels.
struct TransportErrors {
  double frobenius =
      0;  ///< (T̃−T)Z over Rademacher Z: an unbiased estimate of the relative Frobenius error (in squares)
  double indirect = 0;         ///< lit cells A, observed cells not-A: transport without the direct light
  double flood = 0;            ///< all projector pixels on
  double relight_bar = 0;      ///< a vertical bar, an eighth of the width
  double relight_random = 0;   ///< random binary pattern
  double relight_natural = 0;  ///< a smooth textured picture
  double bar_indirect = 0;     ///< the bar, seen only outside it [Garg06 Fig. 8]
};

struct EvaluateOptions {
  int probes = 12;  ///< random vectors for frobenius and indirect
  unsigned seed = 7;
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

}  // namespace symrig
