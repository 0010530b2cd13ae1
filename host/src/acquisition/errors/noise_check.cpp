// SPDX-License-Identifier: Apache-2.0
#include "acquisition/errors/noise_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::acquisition {
namespace {

constexpr double kSigmas = 6;
constexpr std::size_t kFewest = 64;        // samples
constexpr double kGrossRatio = 1.8;        // of variances, either way
constexpr double kGrossShared = 1.4;       // in squares
constexpr double kGrossNeighbours = 0.15;  // correlation
constexpr double kGrossLamp = 0.005;       // share
constexpr double kNoiseFree = 1e-3;        // scatter that photographs without a variance may have, share

Flood flood_of(const TreePhotograph& p) {
  return {{p.mean.begin(), p.mean.end()},
          {p.variance.begin(), p.variance.end()},
          {p.valid.begin(), p.valid.end()}};
}

void add(Flood& sum, const TreePhotograph& p) {
  for (std::size_t at = 0; at < sum.mean.size(); ++at) {
    sum.mean[at] += static_cast<double>(p.mean[at]);
    sum.variance[at] += static_cast<double>(p.variance[at]);
    sum.valid[at] = sum.valid[at] != 0 && p.valid[at] != 0 ? 1 : 0;
  }
}

Flood sum_of(const TreePhotograph& p, const TreePhotograph& q) {
  Flood sum = flood_of(p);
  add(sum, q);
  return sum;
}

Flood sum_of(std::span<const TreePhotograph> parts) {
  Flood sum = flood_of(parts[0]);
  for (const TreePhotograph& p : parts.subspan(1)) add(sum, p);
  return sum;
}

/// The level of b over that of a, by least squares.
FloodLevel level(const Flood& a, const Flood& b) {
  double ab = 0, aa = 0, noise = 0;
  for (std::size_t at = 0; at < a.mean.size(); ++at) {
    if (a.valid[at] == 0 || b.valid[at] == 0) continue;
    ab += a.mean[at] * b.mean[at];
    aa += a.mean[at] * a.mean[at] - a.variance[at];  // noise in both directions would pull it towards 0
    noise += a.mean[at] * a.mean[at] * (a.variance[at] + b.variance[at]);
  }
  if (!(aa > 0)) return {};
  return {ab / aa, std::sqrt(noise) / aa};
}

/// b − level · a, pixel by pixel.
struct FloodDifference {
  PagedVector<double> value, variance;
  PagedVector<char> valid;
};
FloodDifference difference(const Flood& a, const Flood& b) {
  const double g = level(a, b).value;
  FloodDifference d{b.mean, b.variance, b.valid};
  for (std::size_t at = 0; at < d.value.size(); ++at) {
    d.value[at] -= g * a.mean[at];
    d.variance[at] += g * g * a.variance[at];
    d.valid[at] = d.valid[at] != 0 && a.valid[at] != 0 ? 1 : 0;
  }
  return d;
}

/// Mean of so many photographs, of their sum.
void divide(Flood& sum, std::size_t photographs) {
  const auto n = static_cast<double>(photographs);
  for (std::size_t at = 0; at < sum.mean.size(); ++at) {
    sum.mean[at] /= n;
    sum.variance[at] /= n * n;
  }
}

void add(Scatter& scatter, const FloodDifference& d) {
  for (std::size_t at = 0; at < d.value.size(); ++at)
    if (d.valid[at] != 0) scatter.add(d.value[at], d.variance[at]);
}

void add(NeighbourProducts& sums, const BlockTree& tree, const FloodDifference& d) {
  const Grid grid = tree.grid();
  const std::size_t pixels = grid.size();
  std::vector<double> raster(pixels);
  for (std::size_t first = 0; first < d.value.size(); first += pixels) {
    for (std::size_t t = 0; t < pixels; ++t) {
      const bool usable = d.valid[first + t] != 0 && d.variance[first + t] > 0;
      const double v = usable ? d.value[first + t] / std::sqrt(d.variance[first + t]) : 0;
      raster[tree.order()[t]] = v;
      sums.squares += v * v;
      sums.pairs += usable ? 1 : 0;
    }
    const std::size_t cols = grid.cols;
    for (std::size_t i = 0; i < pixels; ++i) {
      if (i % cols + 1 < cols) sums.right += raster[i] * raster[i + 1];
      if (i + cols < pixels) sums.below += raster[i] * raster[i + cols];
    }
  }
}

/// Σ d² over Σ v, and its standard deviation where noise is independent.
struct VarianceRatio : Scatter {
  bool known() const { return samples >= kFewest && variance > 0; }
  double value() const { return known() ? squares / variance : NoiseCheck::kUnknown; }
  double sigma() const { return std::sqrt(2 * variance_squared) / variance; }
};

/// Correlation of the standardized differences of pixels side by side.
struct Neighbours : NeighbourProducts {
  double value() const {
    if (pairs < kFewest || !(squares > 0)) return NoiseCheck::kUnknown;
    return (std::abs(right) > std::abs(below) ? right : below) / squares;
  }
  double sigma() const { return 1 / std::sqrt(static_cast<double>(pairs)); }
};

/// RMS of a difference as a share of the RMS light.
double scatter_share(const FloodDifference& d, const Flood& light) {
  double squares = 0, signal = 0;
  for (std::size_t at = 0; at < d.value.size(); ++at) {
    if (d.valid[at] == 0) continue;
    squares += d.value[at] * d.value[at];
    signal += light.mean[at] * light.mean[at];
  }
  return signal > 0 ? std::sqrt(squares / signal) : 0;
}

void judge_variance(NoiseCheck& check, const VarianceRatio& between) {
  check.variance_ratio = between.value();
  if (!between.known()) return;
  const double off = std::abs(check.variance_ratio - 1);
  const bool gross = check.variance_ratio > kGrossRatio || check.variance_ratio < 1 / kGrossRatio;
  if (gross && off > kSigmas * between.sigma())
    check.findings.push_back(fmt::format(
        "the variance of flood-lit photographs is {:.3g} times what they state ({} samples): {}",
        check.variance_ratio, between.samples,
        check.variance_ratio > 1 ? "more noise than the noise model holds, or a pattern that flickers"
                                 : "less noise than stated, or photographs that share their noise"));
}

/// The same by the light between two pixels, either of them lit.
void judge_mirrored(NoiseCheck& check, const Scatter& mirrored) {
  const VarianceRatio ratio{mirrored};
  if (!ratio.known()) return;
  check.variance_ratio = ratio.value();
  const double off = std::abs(check.variance_ratio - 1);
  const bool gross = check.variance_ratio > kGrossRatio || check.variance_ratio < 1 / kGrossRatio;
  if (gross && off > kSigmas * ratio.sigma())
    check.findings.push_back(fmt::format(
        "the light from one pixel to another and back differs by {:.3g} times the variance that it "
        "states ({} pairs): the noise model is wrong, or camera and projector do not share their pixels",
        check.variance_ratio, mirrored.samples));
}

void judge_shared(NoiseCheck& check, const VarianceRatio& sum) {
  check.shared_ratio = sum.value();
  if (!sum.known()) return;
  // Wrong variances are told once.
  const double expected = std::isnan(check.variance_ratio) ? 1 : std::max(1.0, check.variance_ratio);
  const double over = check.shared_ratio / expected;
  if (over > kGrossShared && over - 1 > kSigmas * sum.sigma())
    check.findings.push_back(
        fmt::format("parts of the light and all of it do not add up: {:.3g} times the variance that "
                    "noise explains: photographs share noise, light does not add, or, on a registered rig, "
                    "light of pixels on the borders of cells went to the wrong one",
                    over));
}

void judge_neighbours(NoiseCheck& check, const Neighbours& found) {
  check.neighbours = found.value();
  if (std::isnan(check.neighbours)) return;
  if (std::abs(check.neighbours) > kGrossNeighbours && std::abs(check.neighbours) > kSigmas * found.sigma())
    check.findings.push_back(
        fmt::format("the noise of neighbouring pixels is correlated by {:.2f}", check.neighbours));
}

/// levels: of the lamp, over that of the first photograph.
void judge_lamp(NoiseCheck& check, std::span<const FloodLevel> levels) {
  double squares = 0, sigma = 0;
  for (const FloodLevel& one : levels) {
    squares += (one.value - 1) * (one.value - 1);
    sigma = std::max(sigma, one.sigma);
  }
  check.lamp = std::sqrt(squares / static_cast<double>(levels.size()));
  if (check.lamp > kGrossLamp && check.lamp > kSigmas * sigma)
    check.findings.push_back(fmt::format(
        "the light changed by {:.2g} % between photographs of the same pattern", 100 * check.lamp));
}

}  // namespace

void FloodNoise::add(const TreePhotograph& photograph) {
  Flood flood = flood_of(photograph);
  if (taken_++ == 0) {
    first_ = sum_ = flood;
  } else {
    const FloodDifference d = difference(before_, flood);
    acquisition::add(between_, d);
    acquisition::add(neighbours_, tree_, d);
    levels_.push_back(level(first_, flood));
    acquisition::add(sum_, photograph);
  }
  before_ = std::move(flood);
}

// Three sums that noise alone explains, each Σ difference² / Σ stated variance, 1 if all is as stated:
// 1. Neighbours in time: a flood-lit photograph less g times the one before. g, by least squares, takes
//    out the lamp. It tells whether photographs scatter as they state (variance_ratio). Noise that all of
//    them share is in both and cancels.
// 2. Parts and whole: half + other half less g times the mean of the flood-lit ones. Light adds up, and
//    so does noise that is shared: twice in the sum, once in the mean. So this one shows it
//    (shared_ratio). The same with other patterns that add up to all pixels (besides.parts); the larger
//    ratio counts.
// 3. Light between two pixels and back, after brute force: T_ij − T_ji (besides.mirrored), in place of 1
//    where there is such light.
// Neighbours in space: the correlation of standardised differences of pixels side by side; 0 is as it
// should be. A finding needs both: far off (the kGross values), and off beyond chance (six standard
// deviations; that of a ratio of n samples is √(2/n)).
NoiseCheck FloodNoise::judge(const TreePhotograph* half, const TreePhotograph* other,
                             const NoiseEvidence& besides) && {
  NoiseCheck check;
  if (taken_ == 0) return check;
  judge_variance(check, VarianceRatio{between_});
  judge_mirrored(check, besides.mirrored);
  if (half != nullptr && other != nullptr) {
    const Flood sum = sum_of(*half, *other);
    const Flood mean = mean_away();
    const FloodDifference d = difference(mean, sum);
    VarianceRatio together;
    acquisition::add(together, d);
    VarianceRatio parts;
    if (!besides.parts.empty()) acquisition::add(parts, difference(mean, sum_of(besides.parts)));
    judge_shared(check, parts.known() && parts.value() > together.value() ? parts : together);
    if (taken_ < 2) acquisition::add(neighbours_, tree_, d);
    if (together.variance == 0 && together.samples >= kFewest && scatter_share(d, mean) > kNoiseFree)
      check.findings.push_back(fmt::format(
          "photographs state no noise, but two halves of the light and all of it differ by {:.2g} %",
          100 * scatter_share(d, mean)));
    levels_.push_back(level(first_, sum));
  }
  judge_neighbours(check, Neighbours{neighbours_});
  if (!levels_.empty()) judge_lamp(check, levels_);
  return check;
}

Flood FloodNoise::mean_away() {
  divide(sum_, taken_);
  return std::move(sum_);
}

double changed_lamp(const NoiseCheck& check) {
  return !check.findings.empty() && check.lamp > kGrossLamp ? check.lamp : 0;
}

double doubted_variance(const NoiseCheck& check) {
  if (check.findings.empty()) return 1;
  constexpr double kEach = 3;  // shared noise is in the tensor too
  double ratio = 1;
  if (check.variance_ratio > 0) ratio = std::max({ratio, check.variance_ratio, 1 / check.variance_ratio});
  if (check.shared_ratio > 0) ratio = std::max(ratio, 1 + kEach * (check.shared_ratio - 1));
  return std::min(ratio, 100.0);
}

}  // namespace symrig::acquisition
