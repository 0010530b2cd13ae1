// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/context.hpp"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// Fits every number of the known transport (leaf factors and scalars) to all photographs at once:
///   minimise φ = Σ_k Σ_i w_ik (y_ik − (T p_k)_i)²,  w = 1 / (Var + misfit²)
/// Gauss-Newton: the product a b' is linear in δa and in δb; the normal equations are solved by conjugate
/// gradients with a diagonal preconditioner, never formed. A step that would raise φ is halved, so φ falls
/// monotonically. Without weights the direct light's noise would drown the indirect light. Memory: five
/// numbers for each one stored, and 32 photographs. Time: a step reads the photographs steps + 3 times.
class Polish {
 public:
  /// Photographs [first, last) of the log, in several ranges. misfit: mean square a sample may miss, a
  /// channel.
  struct Range {
    std::int64_t first, last;
  };
  Polish(Context& context, std::vector<Range> photographs, std::vector<double> misfit);

  /// One Gauss-Newton step of at most `steps` conjugate-gradient steps. Returns φ before and after.
  /// fails: as PhotographLog; interrupted. The known transport is changed only when the step is complete.
  struct Outcome {
    double before = 0, after = 0;
  };
  Result<Outcome> step(int steps);

 private:
  using Numbers = std::vector<float>;  ///< one for each factor, then one for each scalar value
  /// For each photograph of a range: residual or image, weight.
  using Visit = std::function<void(std::span<TreePhotograph> photographs)>;
  Result<void> visit(const Visit& visit) const;
  void weigh(TreePhotograph& photograph) const;
  void image(const Numbers& direction, const TreePhotograph& photograph, std::span<float> y) const;
  void gather(std::span<const TreePhotograph> weighted, Numbers& gradient, Numbers* diagonal) const;
  Result<double> misfit_of(const Known& known) const;
  void shorten(Numbers& move) const;
  Numbers numbers() const;

  Context& context_;
  std::vector<Range> ranges_;
  std::vector<double> misfit_;
};

}  // namespace symrig::acquisition
