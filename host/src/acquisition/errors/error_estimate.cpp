// SPDX-License-Identifier: Apache-2.0
#include "acquisition/errors/error_estimate.hpp"

#include "acquisition/errors/gain_mismatch.hpp"
#include "acquisition/errors/noise_check.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace symrig::acquisition {
namespace {

constexpr double kSignalSigmas = 3;  // standard deviations: below, there is nothing to be relative to
/// The stated variance of the photographs may be off by this share of itself (one sigma).
constexpr double kVarianceError = 0.015;
/// An interval is never narrower than this share of its square, by chance agreement of few blocks.
constexpr double kLeastScatter = 0.1;
/// Sums of 32-bit numbers, and of signals that another sum has rounded.
constexpr double kRounding = 1e-3;

using Bar = ErrorBar;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

bool given(const Bar& bar) {
  return std::isfinite(bar.value);
}

bool nothing_seen(const EnergySums& sums) {
  return sums.signal <= kSignalSigmas * std::sqrt(sums.resolution());
}

/// √(error / signal), never below what the noise can resolve. Exactly dark photographs have no error to tell.
double relative(const EnergySums& sums) {
  if (nothing_seen(sums)) return sums.noise == 0 && sums.error == 0 ? 0 : kNone;
  return std::sqrt(std::max({sums.error, std::sqrt(sums.resolution()), 0.0}) / sums.signal);
}

/// Variance by the photographs' noise, and by how well its variance is known.
double noise_variance(const EnergySums& sums, double noise_ratio) {
  const double misstated = (kVarianceError + std::abs(noise_ratio - 1)) * sums.noise;
  return sums.error_noise() + misstated * misstated;
}

/// An error whose pattern is the one asked for: only noise is in the way.
Bar of_this_pattern(const EnergySums& sums, double noise_ratio) {
  const double value = relative(sums);
  if (!(value > 0)) return {value, value};
  constexpr double kSigmas = 2;
  const double spread = kSigmas * std::sqrt(noise_variance(sums, noise_ratio));
  const double of_signal = kSigmas * std::sqrt(sums.signal_noise()) / sums.signal;
  return {value, half_width({sums.error - spread, sums.error + spread}, sums.signal, value) +
                     value * (of_signal + kRounding)};
}

/// An error over all patterns of a kind, of which one was shown. times: by how much its variance is more than
/// that of one sample.
EnergyInterval over_patterns(const EnergySums& sums, const BlockTree& tree, double noise_ratio,
                             double times) {
  const double ratio = std::clamp(sums.error / sums.signal, 0.0, 1.0);
  const double misstated = (kVarianceError + std::abs(noise_ratio - 1)) * sums.noise;
  const double scatter =
      times * sums.scatter(tree, ratio) + misstated * misstated + std::pow(kLeastScatter * sums.error, 2);
  return energy_interval(sums.error, std::max(scatter, sums.resolution()));
}

Bar of_patterns(const EnergySums& sums, const BlockTree& tree, double noise_ratio, double times) {
  const double value = relative(sums);
  if (!(value > 0)) return {value, value};
  return {value, half_width(over_patterns(sums, tree, noise_ratio, times), sums.signal, value)};
}

/// One estimate of the same energy ratio.
struct EnergyReading {
  double value, variance;
};

/// Two readings, weighted by their variances; where they contradict each other, the interval holds both.
Bar joined(const std::vector<EnergyReading>& readings) {
  double weights = 0, sum = 0;
  for (const EnergyReading& r : readings) {
    weights += 1 / r.variance;
    sum += r.value / r.variance;
  }
  const double mean = sum / weights;
  double contradiction = 0;
  for (const EnergyReading& r : readings) contradiction += std::pow(r.value - mean, 2) / r.variance;
  const double variance = std::max(1.0, contradiction) / weights;
  EnergyInterval interval = energy_interval(mean, variance);
  constexpr double kContradiction = 4;
  if (contradiction > kContradiction)
    for (const EnergyReading& r : readings) {
      const EnergyInterval one = energy_interval(r.value, r.variance);
      interval = {std::min(interval.low, one.low), std::max(interval.high, one.high)};
    }
  const double value = std::sqrt(std::max(mean, std::sqrt(variance) / 2));
  return {value, half_width(interval, 1, value)};
}

/// Light between lit and other pixels, from the sparse pairs and from the dark pixels of the random halves.
class Indirect {
 public:
  Indirect(const ErrorSums& sums, double noise_ratio)
      : sums_(sums), pairs_(sums.sparse_pairs), lit_(sums.lit), noise_ratio_(noise_ratio) {}

  /// Σ of squares of all entries between pixels that are wrong, as the sparse pairs see it.
  double wrong_entries() const {
    const double seen = lit_ * (1 - lit_) * static_cast<double>(sums_.sets);
    return seen > 0 ? std::max(0.0, pairs_.error) / seen : 0;
  }

  Bar bar() const {
    const double plain = relative(pairs_);
    if (!(plain > 0)) return {plain, plain};
    return joined(readings());
  }

 private:
  /// Few pixels are lit, and smooth light makes ‖T z‖² of one z scatter far more than ‖E z‖². So the signal
  /// is that of the tensor over many z, scaled by what the tensor gets of this z. Where the tensor holds
  /// little of the light, error and signal scatter together, and their plain ratio is better.
  double signal() const {
    const double share = std::clamp(pairs_.error / pairs_.signal, 0.0, 1.0);
    if (pairs_.model <= 0) return pairs_.signal;
    const double mean = sums_.mean_sparse_energy(lit_) * static_cast<double>(pairs_.samples());
    if (!(mean > 0)) return pairs_.signal;
    return pairs_.signal * std::pow(mean / pairs_.model, (1 - share) * (1 - share));
  }

  std::vector<EnergyReading> readings() const {
    constexpr double kSignalKnown = 0.15;  // of the energy: chance of the model's own mean
    const double of = signal();
    const double ratio = std::clamp(pairs_.error / pairs_.signal, 0.0, 1.0);
    const double misstated = (kVarianceError + std::abs(noise_ratio_ - 1)) * pairs_.noise;
    const double known = std::pow(kSignalKnown * (1 - ratio) * pairs_.error, 2);
    const double floor = std::pow(kLeastScatter * pairs_.error, 2);
    const double scatter = std::max(pairs_.scatter(sums_.tree, ratio), pairs_.resolution());
    std::vector<EnergyReading> readings{
        {pairs_.error / of, (scatter + misstated * misstated + known + floor) / (of * of)}};
    // Where half of the light is wrong, it is wrong everywhere alike, and the halves see its sum.
    constexpr double kMostForHalves = 0.05;
    if (readings[0].value < kMostForHalves) readings.push_back(halves(of));
    return readings;
  }

  /// A dark pixel of a half sees ½ (Σ_j E_ij + Σ_j ± E_ij). Where errors are independent of each other, twice
  /// the squares of both halves are Σ E². Where they add up, it is up to twice as much.
  EnergyReading halves(double of) const {
    constexpr double kAddUp = 0.5;  // of the energy, one sigma
    const EnergySums& dark = sums_.dark_halves;
    const double scale = 2 * lit_ * sums_.dark_share / of;
    const double energy = scale * dark.error;
    const double misstated = (kVarianceError + std::abs(noise_ratio_ - 1)) * dark.noise;
    const double scatter = std::max(dark.scatter(sums_.tree, 0), dark.resolution());
    return {energy, scale * scale * (scatter + misstated * misstated) + std::pow(kAddUp * energy, 2)};
  }

  const ErrorSums& sums_;
  const EnergySums& pairs_;
  double lit_;
  double noise_ratio_;
};

/// Contrast of the smooth picture: deviation over mean.
double contrast(Grid grid) {
  const Image<float> picture = natural_pattern(grid, 1);
  double sum = 0, squares = 0;
  for (const float v : picture.values()) {
    sum += v;
    squares += static_cast<double>(v) * static_cast<double>(v);
  }
  const auto n = static_cast<double>(picture.values().size());
  return sum > 0 ? std::sqrt(std::max(0.0, squares / n * n * n / (sum * sum) - 1)) : 0;
}

/// The check shows a picture cut at its median. Its edges are harder than those of a smooth picture, which is
/// even light and `contrast` of detail. Smooth light hides some of the detail's error. What remains is at
/// least the error of even light.
Bar of_pictures(Bar cut, double flood, Grid grid) {
  if (!(cut.value > 0)) return cut;
  const double detail = std::max(0.0, 2 * cut.value * cut.value - flood * flood);
  constexpr double kHidden = 0.25;  // of the detail's error, at the least left
  const double c = kHidden * contrast(grid);
  const double least = std::min(cut.value, std::sqrt(flood * flood + c * c * detail));
  return {cut.value, cut.value - least + cut.half_width};
}

constexpr const char* kTooDark = "the photographs show no such light above their noise";
constexpr const char* kOneSidedReason =
    "light goes from lit pixels to one side and not back: check the alignment of camera and projector "
    "(symrig align, or check_axis of a capture)";

/// Collects bars under their keys.
class Table {
 public:
  void set(const char* key, double TransportErrors::*field, const Bar& bar, const char* reason) {
    estimate_.value.*field = given(bar) ? bar.value : kNone;
    estimate_.half_width.*field = given(bar) ? bar.half_width : kNone;
    if (!given(bar)) estimate_.not_given.push_back({key, reason});
  }
  ErrorEstimate take() && { return std::move(estimate_); }

 private:
  ErrorEstimate estimate_;
};

}  // namespace

ErrorBar frobenius_error(const BlockTree& tree, std::span<const Checks::Residual> residuals,
                         std::span<const TreePhotograph> left) {
  std::vector<CheckResidual> set;
  for (const std::size_t k : {Checks::kHalf, Checks::kOtherHalf})
    set.push_back({residuals[k].photograph, left[k].mean});
  EnergySums sums(tree.order().size());
  add_signed_halves(set, GainError(), sums);
  const Bar bar = of_patterns(sums, tree, 1, 1);
  return given(bar) ? bar : Bar{};
}

ErrorEstimate estimate_errors(const ErrorSums& sums, double noise_ratio) {
  constexpr double kOneSidedSigmas = 5;
  constexpr double kOneSidedShare = 0.1;  // of the squared error between pixels
  const BlockTree& tree = sums.tree;
  const Indirect indirect(sums, noise_ratio);
  const EnergySums& halves = sums.halves;
  const OneSided& one = sums.one_sided;
  const bool lopsided =
      one.sigmas > kOneSidedSigmas && one.energy > kOneSidedShare * indirect.wrong_entries();
  // What a rig in line would show is up to twice the one-sided part away.
  const double away = lopsided && halves.signal > 0
                          ? 2 * std::sqrt(one.energy * static_cast<double>(sums.sets) / halves.signal)
                          : 0;
  const auto further = [&](Bar b) { return Bar{b.value, b.half_width + std::min(away, 2 * b.value)}; };
  const Bar unknown{kNone, kNone};
  Table table;
  const Bar even = of_this_pattern(sums.flood, noise_ratio);
  table.set("frobenius", &TransportErrors::frobenius, further(of_patterns(halves, tree, noise_ratio, 1)),
            kTooDark);
  table.set("indirect", &TransportErrors::indirect, lopsided ? unknown : indirect.bar(),
            lopsided ? kOneSidedReason : kTooDark);
  table.set("flood", &TransportErrors::flood, further(even), kTooDark);
  table.set("relight.bar", &TransportErrors::relight_bar, further(of_this_pattern(sums.bar, noise_ratio)),
            kTooDark);
  table.set("relight.random", &TransportErrors::relight_random,
            further(of_patterns(sums.half, tree, noise_ratio, 2)), kTooDark);
  table.set("relight.natural", &TransportErrors::relight_natural,
            further(of_pictures(of_patterns(sums.natural, tree, noise_ratio, 2), given(even) ? even.value : 0,
                                tree.grid())),
            kTooDark);
  table.set("bar_indirect", &TransportErrors::bar_indirect,
            lopsided ? unknown : of_this_pattern(sums.outside_bar, noise_ratio),
            lopsided ? kOneSidedReason : kTooDark);
  return std::move(table).take();
}

ErrorEstimate estimate_errors(const ErrorSums& sums, const NoiseCheck& noise) {
  ErrorEstimate estimate = estimate_errors(sums, doubted_variance(noise));
  // Held-out photographs are of the beginning. All light is as uncertain as that of the lamp.
  const double lamp = changed_lamp(noise);
  if (lamp == 0) return estimate;
  using E = TransportErrors;
  for (const auto field : {&E::frobenius, &E::indirect, &E::flood, &E::relight_bar, &E::relight_random,
                           &E::relight_natural, &E::bar_indirect}) {
    estimate.value.*field = std::hypot(estimate.value.*field, lamp);
    estimate.half_width.*field += lamp;
  }
  return estimate;
}

}  // namespace symrig::acquisition
