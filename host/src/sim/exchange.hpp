// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/groove.hpp"

#include <functional>
#include <memory>
#include <span>

namespace symrig::sim {

/// out = F in: light from each plane of a groove to the other, F = [0 M; Mᵀ 0]. Whatever approximates M is
/// applied with the same numbers both ways, so F is symmetric by construction. shapes: groove grid, raster.
/// Thread-safe for reading.
class Exchange {
 public:
  Exchange() = default;
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;
  virtual ~Exchange() = default;
  virtual void apply(std::span<const float> in, std::span<float> out) const = 0;
};

/// Relative error of every entry of the open exchange against point_form_factor, beside kGaussianSumError:
/// rounding of float sums of positive terms.
inline constexpr double kExchangeRounding = 4e-6;

/// Exchange of an empty groove: every point of one plane sees every point of the other.
///
/// M = Σ_q A_q G_q B_q: by inverse_square, s t / r⁴ = Σ_q w_q (s e^{−2 τ_q s²}) e^{−τ_q dy²} (t e^{−2 τ_q
/// t²}), so each term weighs and sums the columns, blurs the one column that is left along y by a Gaussian,
/// and spreads it on the columns of the other plane. All numbers are positive: no entry of M can be negative.
/// cost: about 2 · terms · N multiply-adds and terms · rows² for the blurs, halved by dropping what is
/// negligible.  error: every entry within kGaussianSumError + kExchangeRounding of point_form_factor,
/// relative.
std::unique_ptr<Exchange> open_exchange(const Groove& groove);

/// True where a point s from the crease on the left plane sees a point t from it on the right one.
using Sight = std::function<bool(double s, double t)>;

/// Exchange of a groove with a blocker that reaches along the whole crease, so that visibility depends on the
/// two columns alone: M[s, t] is a convolution along y, held as its (real) spectrum for each pair of columns
/// that see each other. High frequencies are kept near the crease only: the spectrum of 1/(a² + y²)²
/// falls as (1 + aω) e^{−aω}.
/// cost: one FFT of 2.5 rows a column and direction, then the kept products.  error: every entry within 3e-6
/// of the largest entry of its pair of columns, plus 2e-8 (two columns share a transform, and its rounding);
/// entries may fall below zero by as much. Visibility itself is exact.  source: form factors of groove.hpp.
std::unique_ptr<Exchange> masked_exchange(const Groove& groove, const Sight& sees);

/// The exchange of a groove cut into chambers by opaque fins across it: no light passes from one to another.
struct Chamber {
  int row_begin, row_end;
  std::unique_ptr<Exchange> exchange;  ///< on the rows of the chamber
};
std::unique_ptr<Exchange> chambered_exchange(Grid grid, std::vector<Chamber> chambers);

/// Exchange of a groove with two thin opaque fins in it. Both stand edge-on to the rig, so that neither is
/// seen nor shades direct light:
///   - one across the groove at 37 % of its height, as tall as the groove: no light passes it;
///   - below it one along the crease, hovering over it between 4 % and 15 % of the width: it hides (s, t)
///   whose
///     connecting line crosses the plane of the crease at such a height, 2 s t / (s + t).
/// Near the crease light passes below the second fin, far from it above.
std::unique_ptr<Exchange> occluded_exchange(const Groove& groove);

/// True where the hovering fin does not hide s and t from each other.
bool passes_hovering_fin(const Groove& groove, double s, double t);
/// First row below the fin across the groove.
int row_of_cross_fin(const Groove& groove);

}  // namespace symrig::sim
