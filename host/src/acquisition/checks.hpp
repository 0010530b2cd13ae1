// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/context.hpp"
#include "acquisition/rank_test.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/tensor/file.hpp"

#include <cstdint>
#include <vector>

namespace symrig::acquisition {

/// Six photographs that no part of the tensor is made from. Their patterns have nothing to do with blocks: a
/// random half of the pixels and its complement, two random thirty-seconds, a bar, and a picture of all
/// scales cut at its median.
class Checks {
 public:
  static constexpr std::int64_t kCount = 6;  ///< photographs

  /// Takes them.  fails: as Probe::measure.
  static Result<Checks> take(Context& context);

  /// What the known transport leaves of each check photograph.
  struct Residual {
    TreePhotograph photograph;    ///< pattern as shown, mean as measured
    std::vector<float> residual;  ///< [channel][pixel]
  };
  Result<std::vector<Residual>> residuals(const Context& context) const { return residuals(context, kAll); }
  /// Only the two halves: enough for frobenius(), at a third of the price.
  Result<std::vector<Residual>> residuals_of_halves(const Context& context) const {
    return residuals(context, kHalves);
  }
  static double frobenius(std::span<const Residual> halves);

  /// The errors of DESIGN §4 as far as photographs can tell: squares of the residual less their noise, over
  /// squares of the photograph less its noise; never below what the noise of the check itself can resolve.
  static TransportErrors errors(const std::vector<Residual>& residuals);

  /// Mean square of what the known transport misses where the random half is dark, beyond noise, by channel:
  /// the error that half the light leaves in a sample. Those whose pixels are lit independently of each
  /// other.
  static std::span<const Residual> random(const std::vector<Residual>& residuals) {
    return std::span(residuals).first(4);
  }
  static std::vector<double> misfit_of_half(const std::vector<Residual>& residuals);
  /// Log numbers [first, last) of the check photographs.
  std::int64_t first() const { return first_; }
  std::int64_t last() const;

  /// The photographs as they are kept in scene.h5.
  Result<std::vector<HeldOut>> held_out(const Context& context) const;

 private:
  static constexpr std::int64_t kAll = 6, kHalves = 2;
  Result<std::vector<Residual>> residuals(const Context& context, std::int64_t count) const;

  std::int64_t first_ = 0;  // log number
};

/// What the check photographs say of ranges of pixels, seen only where they are dark: there no direct light
/// and little noise is in the way.
class DarkExcess {
 public:
  DarkExcess(std::span<const Checks::Residual> residuals, std::span<const double> flood_squared);

  /// Σ residual² of pixels [begin, end) in units of F², and what noise explains of it, as the rank test
  /// counts.
  Comparison of(std::int32_t begin, std::int32_t end) const;
  /// Σ of the light that check k puts into pixels [begin, end): Σ pattern.
  double lit(std::size_t check, std::int32_t begin, std::int32_t end) const;

 private:
  std::vector<Comparison> before_;               // running sums over pixels
  std::vector<std::vector<double>> lit_before_;  // [check], running sums
};

}  // namespace symrig::acquisition
