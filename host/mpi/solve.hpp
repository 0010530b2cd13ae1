// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/transport_operator.hpp"

#include <string>

namespace symrig::mpi {

struct SolveOptions {
  double most = 1;           ///< largest light of a pixel; 1 is full light
  double tolerance = 0.001;  ///< stop when residual − unreachable is at most this
  int applications = 50;     ///< of T and Tᵀ together, at most
  /// For comparisons (docs/research/machines.md): TAO's name of a solver with bounds, and D = 1 if not
  /// scaled.
  std::string method = "bqnls";
  bool scaled = true;
};

struct Solution {
  Image<float> light;      ///< projector grid, 0 to SolveOptions::most
  double residual = 0;     ///< ‖T p − w‖ / ‖w‖ over all channels
  double unreachable = 0;  ///< no light in the bounds has a smaller residual (unreachable_share())
  int applications = 0;    ///< of T and Tᵀ together
  bool converged = false;  ///< residual − unreachable ≤ tolerance
};

/// Inverse light transport: the light that makes the scene look as wanted,
///   minimise ½ ‖T p − w‖²  over  0 ≤ p ≤ most,
/// by PETSc's TAO on the scaled light q = D p, D = diag(Tᵀ 1) / √channels: a pixel's light weighs as all
/// light that it sends to the camera. So dark and bright places converge alike. If T is diagonal and grey,
/// TᵀT = D². The start is q = Tᵀ w / D within the bounds. PETSc runs in this process alone, because its
/// vectors have one value a pixel; only T is dealt over ranks. shapes: wanted has the camera's grid and
/// channels. error: residual is measured with the light as it is returned, in float sums of T. fails:
/// size_mismatch; bad_value (not finite, or dark everywhere); bad_argument (options out of range);
/// interrupted; as TransportOperator.  source: [Seitz05] for the inverse, [Benson01] for bounded quasi-Newton
/// steps
Result<Solution> solve(const TransportOperator& transport, const Image<float>& wanted,
                       const SolveOptions& options, const Progress& progress = {});

/// A proof of what cannot be reached. r = w − T p of any p. The set {T p : 0 ≤ p ≤ most} lies on one side of
/// the plane r · y = max_p r · T p = most Σ_j max(0, (Tᵀ r)_j), so w is at least (r · w − that) / ‖r‖ away
/// from it. Returned as a share of ‖w‖, at least 0. At the best light it equals the residual.
double unreachable_share(const Image<float>& wanted, const Image<float>& rest,
                         const Image<float>& adjoint_of_rest, double most);

}  // namespace symrig::mpi
