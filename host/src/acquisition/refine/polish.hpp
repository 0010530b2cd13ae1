// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/refine/polish_jacobian.hpp"
#include "acquisition/tree/known_transport.hpp"
#include "acquisition/tree/photographer.hpp"
#include "acquisition/tree/search_facts.hpp"
#include "symrig/base/result.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// Rounds numbers to multiples of one power of two q. As long as a sum of them stays below 2⁵³ q, doubles
/// hold it exactly, so it has the same bits in any order. [Demmel13]
/// error: ≤ q / 2 = 2⁻⁵⁰ most a number.
class ExactSums {
 public:
  /// most: bounds each number, and the sum of the magnitudes of those that are added up. Both may be twice
  /// that: whoever computes numbers in floats exceeds his bound by their rounding.
  explicit ExactSums(double most) {
    int exponent = 0;  // most < 2^exponent
    static_cast<void>(std::frexp(most, &exponent));
    // Numbers up to 2^(exponent + 1) = 2⁵¹ q leave shift + number between 2⁵² q and 2⁵³ q, where doubles are
    // multiples of q.
    shift_ = most > 0 ? std::ldexp(1.5, exponent - 50 + 52) : 0;
  }
  double rounded(float number) const { return (static_cast<double>(number) + shift_) - shift_; }

 private:
  double shift_;
};

/// How the transport of a polish is dealt. T is the sum of parts, and each of several processes has some of
/// them. All processes run the same polish on the same photographs: each call here is made by all of them, in
/// the same order. This class is one process with all of T in one part.
class PolishTeam {
 public:
  PolishTeam() = default;
  PolishTeam(const PolishTeam&) = delete;
  PolishTeam& operator=(const PolishTeam&) = delete;
  virtual ~PolishTeam() = default;

  /// Parts of all processes together.
  virtual std::size_t parts() const { return 1; }
  /// The number of the first part here; the others here follow it. Exactly one process has part 0.
  virtual std::size_t first() const { return 0; }

  /// Each value becomes its sum over the processes, on all of them. The sums are exact in any order
  /// (ExactSums), so how many processes there are changes no bit.
  virtual void add_up(std::span<double> /*values*/) const {}
  /// The first failure of any process, on all of them.
  virtual Result<void> all(const Result<void>& mine) const { return mine; }
};

/// Fits every number of the known transport (leaf factors and scalars) to all photographs at once:
///   minimise φ = Σ_k Σ_i w_ik (y_ik − (T p_k)_i)²,  w = 1 / (Var + misfit²)
/// Gauss-Newton: the product a b' is linear in δa and in δb. Conjugate gradients with a diagonal
/// preconditioner solve the normal equations, which are never formed. Without weights the direct light's
/// noise would hide the indirect light.
///
/// The linear model leaves out δa δb'. A leaf that holds little but noise hardly changes φ to first order,
/// even where both factors grow a hundredfold. Then δa δb' outweighs all other errors. So no factor moves by
/// more than half its own length in a step, and a step that would raise φ is halved: φ falls monotonically.
///
/// Memory: eight numbers for each one stored, 64 photographs, and 8 bytes a sample of all photographs where
/// these fit (kKeptBytes). Where they do not fit, they are read again and again. Time: a step goes through
/// the photographs steps + 2 times. Bit-equal for any number of threads.
///
/// T may be dealt (PolishTeam). Leaves meet only in photographs: each process adds up the light of its parts,
/// the sum over the processes is one picture a photograph and pass, and all else concerns one leaf. Every
/// part adds up its own light in floats. Sums over parts are exact (ExactSums), and sums over numbers go part
/// by part. So the result depends on the parts, and not on how many processes have them. Memory then: 8 bytes
/// more for each sample of 64 photographs, and the numbers of the parts here only.
class Polish {
 public:
  /// misfit: mean square a sample may miss, a channel.
  Polish(const SearchFacts& facts, const Photographer& photographer, KnownTransport& known,
         std::vector<LogRange> photographs, std::vector<double> misfit);
  /// parts: those of T that this process has. pixels: of the grid. All must outlive this.
  struct Photographs {
    std::size_t pixels;
    std::vector<LogRange> ranges;
    std::vector<double> misfit;  ///< one a channel
  };
  Polish(const PolishTeam& team, std::span<KnownTransport> parts, const Photographer& photographer,
         Photographs photographs);

  /// About what a step counts with its photographer's Work.
  std::int64_t operations(int steps) const;
  /// One Gauss-Newton step of at most `steps` conjugate-gradient steps. Returns φ before and after.
  /// fails: as PhotographLog and PolishTeam::all; interrupted.  throws: Stopped. The known transport is
  /// changed only when the step is complete.
  struct Outcome {
    double before = 0, after = 0;
  };
  Result<Outcome> step(int steps);

 private:
  using Numbers = std::vector<PolishNumbers>;  ///< of each part
  using Samples = std::vector<PolishSamples>;  ///< of each batch
  using Tangents = std::vector<PolishJacobian::Tangents>;
  /// residuals: mean = what is left of the photograph, variance = its weight.
  using UseResiduals = std::function<void(std::span<TreePhotograph> residuals)>;
  using Use = std::function<void(std::span<TreePhotograph> photographs)>;
  Result<void> visit(const Use& use) const;
  Result<double> visit_residuals(const UseResiduals& use) const;
  void weigh_all(std::span<TreePhotograph> photographs) const;
  void weigh(TreePhotograph& photograph) const;
  bool keeps() const;
  std::int64_t photographs() const;
  bool dealt() const { return team_.parts() > 1; }
  double sum_of_parts(const std::vector<double>& mine) const;
  double inner(const Numbers& a, const Numbers& b) const;
  void subtract(std::span<TreePhotograph> photographs, double most) const;
  Samples image(std::span<const PolishBatch> batches, const Tangents& direction, double most) const;
  double most(const Numbers* direction) const;
  /// sum = Σ over batches of Jᵀ W J direction.
  Result<void> curved(const Numbers& direction, Numbers& sum) const;
  Result<Numbers> solve(Numbers residual, const Numbers& diagonal, int steps) const;
  void shorten(Numbers& move) const;
  void shorten_part(const KnownTransport& known, PolishNumbers& move) const;
  Result<Outcome> move_along(const Numbers& move, double before);
  Numbers zeros() const;

  const PolishTeam& team_;
  const Photographer& photographer_;
  std::span<KnownTransport> parts_;
  Photographs all_;
  int channels_;
  std::vector<PolishJacobian> jacobians_;  ///< of each part
  std::vector<PolishBatch> kept_;          ///< all photographs, or none if they do not fit
  /// Of several parts or processes. They stay, because new pages take longer than the sums.
  mutable PagedVector<double> light_;              ///< sums over the parts
  mutable std::vector<PagedVector<float>> means_;  ///< of one part
};

}  // namespace symrig::acquisition
