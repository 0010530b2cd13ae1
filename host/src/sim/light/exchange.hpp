// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/light/transport.hpp"
#include "symrig/image/grid.hpp"

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <numbers>
#include <span>
#include <vector>

namespace symrig::sim {

/// Two planes that meet at a right angle in a vertical crease. An orthographic rig looks along the bisector.
/// Lengths are in pixels: column j has its centre at x = j + ½. The crease is at x = 0.47 · cols, so that it
/// is no block boundary. A point at distance s from the crease is at depth s behind the rig's focal plane.
struct Groove {
  explicit Groove(Grid grid_);

  Grid grid;
  double crease;                 ///< x of the crease [px]
  int left_cols = 0;             ///< columns [0, left_cols) show the left plane
  std::vector<double> distance;  ///< of each column's centre from the crease [px]

  int right_cols() const { return grid.cols - left_cols; }
};

/// Both planes are inclined by 45° to the rig, so the light of one projector pixel covers √2 px².
inline constexpr double kForeshortening = 1 / std::numbers::sqrt2;

/// Point form factor between two points on different planes, at distances s and t from the crease and dy
/// apart along it: F = cos θ cos θ' dA / (π r²) = c s t / (2s² + 2t² + dy²)², c = 2√2/π, with cos θ = √2 t /
/// r, cos θ' = √2 s / r and dA = √2 px². Pixel centres on the two planes are at least one pixel apart (r ≥
/// 1), so F ≤ 0.23 without clamping. units: share of the light that leaves the first point.
double point_form_factor(double s, double t, double dy);
inline constexpr double kFormFactorScale = 2 * std::numbers::sqrt2 / std::numbers::pi;

/// 1/u² ≈ Σ_q weight_q exp(−rate_q u), every weight and rate positive, rates ascending.
struct GaussianSum {
  std::vector<double> weight, rate;
};

/// A term whose exponent rate · u exceeds this adds less than 3e-8 of 1/u² and may be dropped.
inline constexpr double kNegligibleExponent = 24;
/// Relative error of the sum over its whole range.
inline constexpr double kGaussianSumError = 3e-6;

/// The terms for lowest ≤ u ≤ highest (0 < lowest): the trapezoidal rule with step h on
/// 1/u² = ∫ τ² exp(−τu) d ln τ.  Its relative error is 2|Γ(2 + 2πi/h)|: 1e-6 at h = 0.54. One term replaces
/// the infinite lower tail, with the tail's weight and mean rate.
/// error: relative, ≤ kGaussianSumError at every u.  terms: about (ln(highest / lowest) + 6) / 0.54.
/// source: the exponential-sum quadrature of [Beylkin05 §3].
GaussianSum inverse_square(double lowest, double highest);

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

/// Light that leaves a groove after one to four reflections:
///   T = cos 45° (R + indirect · Σ_{k=1..3} (R F)^k R),  R = diag(albedo),  F the exchange.
/// Symmetric because R and F are symmetric. units: radiosity towards the rig per unit of projector light on a
/// plane that faces it. With albedo ≤ 0.8 and indirect ≤ 1, every row sums to at most 0.71 · (0.8 + 0.8 x +
/// 0.8 x² + 0.8 x³) ≤ 0.95, x = 0.8 · 0.5. The factor 0.5: the other plane fills at most half of the sky of a
/// point.
/// source: the radiosity series; [Garg06 §4.1] explains why its blocks are low-rank.
class GrooveTransport final : public Transport {
 public:
  GrooveTransport(std::shared_ptr<const Exchange> exchange, std::vector<float> albedo, double indirect);
  void apply(std::span<const float> x, std::span<float> y) const override;

  static constexpr int kBounces = 3;  ///< between the planes, after the direct reflection

 private:
  std::shared_ptr<const Exchange> exchange_;
  std::vector<float> albedo_;
  float indirect_;
};

/// One sample of kFftLanes signals that are transformed together.
inline constexpr std::size_t kFftLanes = 8;
using FftLane = std::array<float, kFftLanes>;

/// kFftLanes complex signals: re[n], im[n].
struct LaneSignal {
  explicit LaneSignal(std::size_t length) : re(length), im(length) {}
  std::vector<FftLane> re, im;
};

/// X(k) = Σ_n x(n) e^{−2πi kn/N} of kFftLanes signals at once; N is a power of two. For the inverse (times
/// N), exchange re and im before and after.
/// error: about 6e-8 · log2 N of the signal's norm.
/// source: the self-sorting radix-2 scheme of Stockham, [VanLoan92 §1.7].
/// [VanLoan92 §1.7].
class LaneFft {
 public:
  explicit LaneFft(std::size_t length);
  std::size_t length() const { return length_; }
  /// In place. scratch has the same length.
  void forward(LaneSignal& signal, LaneSignal& scratch) const;

 private:
  std::size_t length_;
  std::vector<float> cos_, sin_;  // of 2πk/N, k < N/2
};

}  // namespace symrig::sim
