// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/groove.hpp"

#include <memory>
#include <span>

namespace symrig::sim {

/// out = F in: light from each plane of a groove to the other, F = [0 M; Mᵀ 0]. Approximations of M use the
/// same numbers in both directions, so F is symmetric by construction. shapes: groove grid, raster.
/// Thread-safe for reading.
class Exchange {
 public:
  Exchange() = default;
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;
  virtual ~Exchange() = default;
  virtual void apply(std::span<const float> in, std::span<float> out) const = 0;
};

/// Relative error of every entry of the open exchange against point_form_factor, in addition to
/// kGaussianSumError. It is the rounding error of float sums of positive terms.
inline constexpr double kExchangeRounding = 4e-6;

/// Exchange of an empty groove: every point of one plane sees every point of the other.
///
/// By inverse_square, s t / r⁴ = Σ_q w_q (s e^{−2 τ_q s²}) e^{−τ_q dy²} (t e^{−2 τ_q t²}). So M = Σ_q A_q G_q
/// B_q. Each term weights and sums the columns to one column, blurs it along y with a Gaussian, and spreads
/// it over the columns of the other plane. All numbers are positive, so no entry of M can be negative.
/// cost: about 2 · terms · N multiply-adds and terms · rows² for the blurs, half of it after negligible terms
/// are dropped.
/// error: every entry within kGaussianSumError + kExchangeRounding of point_form_factor, relative.
std::unique_ptr<Exchange> open_exchange(const Groove& groove);

}  // namespace symrig::sim
