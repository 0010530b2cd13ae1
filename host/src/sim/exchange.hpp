// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/groove.hpp"

#include <functional>
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

/// True if a point s from the crease on the left plane sees a point t from the crease on the right plane.
using Sight = std::function<bool(double s, double t)>;

/// Exchange of a groove with a blocker along the whole crease, so that visibility depends only on the two
/// columns. M[s, t] is a convolution along y. It is stored as its real spectrum for each pair of columns that
/// see each other. High frequencies are kept only near the crease, because the spectrum of 1/(a² + y²)² falls
/// as (1 + aω) e^{−aω}.
/// cost: one FFT of 2.5 rows per column and direction, then the stored products.
/// error: every entry within 3e-6 of the largest entry of its pair of columns, plus 2e-8 because two columns
/// share a transform. Entries may be negative by the same amounts. Visibility itself is exact.
/// source: form factors of groove.hpp.
std::unique_ptr<Exchange> masked_exchange(const Groove& groove, const Sight& sees);

/// One part of a groove that opaque fins cut into chambers. No light passes between chambers.
struct Chamber {
  int row_begin, row_end;
  std::unique_ptr<Exchange> exchange;  ///< for the rows of the chamber
};
std::unique_ptr<Exchange> chambered_exchange(Grid grid, std::vector<Chamber> chambers);

/// Exchange of a groove with two thin opaque fins. The rig sees both edge-on, so they are invisible and shade
/// no direct light:
///   - one across the groove at 37 % of its height, as tall as the groove: no light passes it;
///   - one below it along the crease, between 4 % and 15 % of the width above the crease. It hides (s, t) if
///     their connecting line crosses the plane of the crease in this range, at height 2 s t / (s + t).
/// Light passes below the second fin near the crease, and above it far from the crease.
std::unique_ptr<Exchange> occluded_exchange(const Groove& groove);

/// True if the second fin does not hide s and t from each other.
bool passes_hovering_fin(const Groove& groove, double s, double t);
/// First row below the fin across the groove.
int row_of_cross_fin(const Groove& groove);

}  // namespace symrig::sim
