// SPDX-License-Identifier: Apache-2.0
#include "acquisition/errors/error_estimate.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/image/image.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace symrig::acquisition {

void EnergySums::add(std::size_t pixel, double e, double y, double of_model, double variance) {
  error += e * e - variance;
  signal += y * y - variance;
  model += of_model * of_model;
  noise += variance;
  error_noise_ += 4 * variance * e * e - 2 * variance * variance;
  signal_noise_ += 4 * variance * y * y - 2 * variance * variance;
  resolution_ += 2 * variance * variance;
  error_at_[pixel] += e * e - variance;
  signal_at_[pixel] += y * y - variance;
  ++samples_;
}

// How much Σ (error − ratio · signal) would differ with other random patterns, from one set of
// photographs. Let d_B be the part of the sum in block B, n the number of blocks of a level, and m the mean
// of d_B. If the blocks were independent, the delete-one jackknife of the sum would be
//
//   Var = n / (n − 1) · Σ_B (d_B − m)² = n / (n − 1) · (Σ d_B² − n m²)
//
// Pixels are not independent: a leaf that is wrong is wrong on a whole block, whose pixels then move
// together. So blocks must be as large as what is wrong, and that is not known. But blocks that are too
// small only give too little variance. Steps: running sums over tree order, in which each block is a
// range; the jackknife of each level with at least 16 blocks, and of the last level; the largest of them,
// and the doubt of what add_error() added.
double EnergySums::scatter(const BlockTree& tree, double ratio) const {
  constexpr std::size_t kFewestBlocks = 16;
  std::vector<double> before(error_at_.size() + 1);
  for (std::size_t t = 0; t < error_at_.size(); ++t)
    before[t + 1] = before[t] + error_at_[t] - ratio * signal_at_[t];
  double largest = 0;
  for (int level = 0; level < tree.levels(); ++level) {
    const auto blocks = static_cast<double>(tree.level(level).size());
    if (tree.level(level).size() < kFewestBlocks && level + 1 < tree.levels()) continue;
    double squares = 0;
    for (const Block& block : tree.level(level)) {
      const double sum = before[block.end] - before[block.begin];
      squares += sum * sum;
    }
    const double mean = before.back() / blocks;
    if (blocks > 1) largest = std::max(largest, (squares - blocks * mean * mean) * blocks / (blocks - 1));
  }
  return largest + doubt_;
}

EnergyInterval energy_interval(double energy, double variance) {
  constexpr double kSigmas = 2, kMostSigmas = 10, kInNoise = 4;
  const double sigma = std::sqrt(std::max(0.0, variance));
  if (energy <= sigma) return {0, std::max(0.0, energy) + kInNoise * sigma};
  const double most = energy + kMostSigmas * sigma;
  // χ²_d / d at ± 2σ is (1 − 2/(9d) ± 2 √(2/(9d)))³; 2/d = variance / energy².
  const double ninth = variance / (9 * energy * energy);
  const auto quantile = [&](double sigmas) {
    return std::pow(std::max(0.0, 1 - ninth + sigmas * std::sqrt(ninth)), 3);
  };
  const double least = quantile(-kSigmas);
  return {energy / quantile(kSigmas), least > 0 ? std::min(most, energy / least) : most};
}

double half_width(const EnergyInterval& interval, double signal, double value) {
  const auto relative = [&](double energy) { return std::sqrt(std::max(0.0, energy) / signal); };
  return std::max(relative(interval.high) - value, value - relative(interval.low));
}

namespace {

constexpr double kSure = 5;  // standard deviations, of some dozen sums

/// Sums over rectangles, what lies outside the picture counted as 0.
class Integral {
 public:
  explicit Integral(const Image<float>& picture)
      : rows_(picture.grid().rows),
        cols_(picture.grid().cols),
        sum_(static_cast<std::size_t>(rows_ + 1) * static_cast<std::size_t>(cols_ + 1)) {
    for (int r = 0; r < rows_; ++r)
      for (int c = 0; c < cols_; ++c)
        sum_[at(r + 1, c + 1)] =
            static_cast<double>(picture.at(r, c)) + sum_[at(r, c + 1)] + sum_[at(r + 1, c)] - sum_[at(r, c)];
  }
  /// Rows [top, bottom], columns [left, right].
  double of(int top, int bottom, int left, int right) const {
    const int r0 = std::clamp(top, 0, rows_), r1 = std::clamp(bottom + 1, 0, rows_);
    const int c0 = std::clamp(left, 0, cols_), c1 = std::clamp(right + 1, 0, cols_);
    return sum_[at(r1, c1)] - sum_[at(r0, c1)] - sum_[at(r1, c0)] + sum_[at(r0, c0)];
  }

 private:
  std::size_t at(int r, int c) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(cols_ + 1) + static_cast<std::size_t>(c);
  }
  int rows_, cols_;
  std::vector<double> sum_;
};

/// A box on one side of a pixel: rows and columns from it.
struct Side {
  int top, bottom, left, right;
  double cells() const { return 2.0 * (bottom - top + 1) * (right - left + 1); }
};
std::array<Side, 4> boxes(int radius) {
  return {{{-radius, radius, 1, radius},
           {1, radius, -radius, radius},
           {1, radius, 1, radius},
           {1, radius, -radius, -1}}};
}
/// Half of the pixels around one, up to two away.
std::vector<Side> neighbours() {
  constexpr int kFar = 2;
  std::vector<Side> all;
  for (int dy = 0; dy <= kFar; ++dy)
    for (int dx = dy == 0 ? 1 : -kFar; dx <= kFar; ++dx) all.push_back({dy, dy, dx, dx});
  return all;
}

/// What one K finds.
class SideSearch {
 public:
  SideSearch(const Image<float>& residual, const Image<float>& z) : z_(z), sums_(residual) {
    for (const float v : z.values()) lit_ += v != 0 ? 1 : 0;
  }
  OneSided with(const Side& s) const {
    const Grid grid = z_.grid();
    double product = 0, squares = 0;
    for (int r = 0; r < grid.rows; ++r)
      for (int c = 0; c < grid.cols; ++c) {
        const auto sign = static_cast<double>(z_.at(r, c));
        if (sign == 0) continue;
        const double w = sums_.of(r + s.top, r + s.bottom, c + s.left, c + s.right) -
                         sums_.of(r - s.bottom, r - s.top, c - s.right, c - s.left);
        product += w * sign;
        squares += w * w;
      }
    if (squares <= 0) return {};
    const double energy =
        (product * product - squares) * static_cast<double>(grid.size()) / (lit_ * lit_ * s.cells());
    return {std::max(0.0, energy), std::abs(product) / std::sqrt(squares)};
  }

 private:
  const Image<float>& z_;
  Integral sums_;
  double lit_ = 0;
};

}  // namespace

OneSided one_sided(const Image<float>& residual, const Image<float>& z) {
  const SideSearch search(residual, z);
  OneSided near;  // neighbours have nothing in common: what they find adds up
  for (const Side& s : neighbours()) {
    const OneSided one = search.with(s);
    near.sigmas = std::max(near.sigmas, one.sigmas);
    if (one.sigmas > kSure) near.energy += one.energy;
  }
  OneSided far;
  const Grid grid = residual.grid();
  for (int radius = 2; 2 * radius < std::max(grid.rows, grid.cols); radius *= 2)
    for (const Side& s : boxes(radius)) {
      const OneSided one = search.with(s);
      if (one.sigmas > kSure && one.energy > far.energy) far = one;
    }
  return near.energy >= far.energy ? near : far;
}

namespace {

using Residuals = std::span<const CheckResidual>;

/// What the tensor leaves of each photograph. Unlike the search's own residuals these know how the finished
/// tensor is rounded.
std::vector<PagedVector<float>> left_by(const TransportTensor& tensor,
                                        std::span<const TreePhotograph* const> photographs,
                                        const Work& work) {
  std::vector<PagedVector<float>> all;
  for (const TreePhotograph* const one : photographs) {
    PagedVector<float>& left = all.emplace_back(one->mean);
    const std::size_t pixels = one->pattern.size();
    std::vector<float> model(pixels);
    for (int channel = 0; channel < tensor.channels(); ++channel) {
      std::fill(model.begin(), model.end(), 0.F);
      tensor.apply_tree(one->pattern, model, channel, false);
      work.add(operations_of_light(tensor) / tensor.channels());
      const std::size_t first = static_cast<std::size_t>(channel) * pixels;
      for (std::size_t t = 0; t < pixels; ++t) left[first + t] -= model[t];
    }
  }
  return all;
}

/// A sample in all the sums that it is part of, for Work.
constexpr std::int64_t kSumOperations = 64;

/// A sum of photographs of a set, looked at where those of `dark` are dark.
struct Sum {
  std::vector<WeightedCheck> of;
  std::vector<std::size_t> dark = {};
};

/// Squares of a sum, over the pixels that are valid in all of its photographs.
void add_squares(Residuals set, const GainError& gain, const Sum& sum, EnergySums& to) {
  const std::size_t pixels = set[0].photograph.pattern.size();
  for (std::size_t at = 0; at < set[0].photograph.mean.size(); ++at) {
    const std::size_t t = at % pixels;
    const auto lit = [&](std::size_t k) { return set[k].photograph.pattern[t] != 0; };
    const auto invalid = [&](const WeightedCheck& one) {
      return set[one.photograph].photograph.valid[at] == 0;
    };
    if (std::any_of(sum.of.begin(), sum.of.end(), invalid) ||
        std::any_of(sum.dark.begin(), sum.dark.end(), lit))
      continue;
    double e = 0, y = 0, variance = 0;
    for (const auto& [photograph, weight] : sum.of) {
      e += weight * static_cast<double>(set[photograph].left[at]);
      y += weight * static_cast<double>(set[photograph].photograph.mean[at]);
      variance += weight * weight * static_cast<double>(set[photograph].photograph.variance[at]);
    }
    to.add(t, e, y, y - e, variance);
    const GainLight light = gain.light(sum.of, at);
    to.add_error(t, light.here * light.there);
  }
}

/// One-sided light by a pair of photographs. sparse: pixels that are lit themselves are not looked at.
OneSided one_sided_light(const TransportTensor& tensor, const CheckResidual& a, const CheckResidual& b,
                         bool sparse) {
  const BlockTree& tree = tensor.camera_tree();
  const std::size_t pixels = a.photograph.pattern.size();
  std::vector<float> z(pixels), left(pixels);
  for (std::size_t t = 0; t < pixels; ++t) z[t] = a.photograph.pattern[t] - b.photograph.pattern[t];
  Image<float> signs(tree.grid()), residual(tree.grid());
  tree.to_raster(z, signs.plane(0));
  OneSided found;
  for (int channel = 0; channel < tensor.channels(); ++channel) {
    const std::size_t first = static_cast<std::size_t>(channel) * pixels;
    for (std::size_t t = 0; t < pixels; ++t) {
      const bool valid = a.photograph.valid[first + t] != 0 && b.photograph.valid[first + t] != 0;
      left[t] = valid && !(sparse && z[t] != 0) ? a.left[first + t] - b.left[first + t] : 0;
    }
    tree.to_raster(left, residual.plane(0));
    const OneSided one = one_sided(residual, signs);
    found = {found.energy + one.energy, std::max(found.sigmas, one.sigmas)};
  }
  return found;
}

OneSided one_sided_light(const TransportTensor& tensor, Residuals set) {
  const OneSided halves = one_sided_light(tensor, set[Checks::kHalf], set[Checks::kOtherHalf], false);
  const OneSided sparse = one_sided_light(tensor, set[Checks::kSparse], set[Checks::kOtherSparse], true);
  return halves.sigmas > sparse.sigmas ? halves : sparse;
}

}  // namespace

void add_signed_halves(Residuals set, const GainError& gain, EnergySums& to) {
  add_squares(set, gain, {{{Checks::kHalf, 1}, {Checks::kOtherHalf, -1}}}, to);
}

FloodSum::FloodSum(std::size_t samples, std::size_t sets)
    : weight_(1 / static_cast<double>(sets)),
      error_(samples),
      photograph_(samples),
      variance_(samples),
      here_(samples),
      there_(samples),
      valid_(samples, 1) {}

void FloodSum::add(Residuals set, const GainError& gain) {
  for (const std::size_t k : {Checks::kHalf, Checks::kOtherHalf}) {
    const CheckResidual& one = set[k];
    const WeightedCheck weighted{k, weight_};
    for (std::size_t at = 0; at < error_.size(); ++at) {
      if (one.photograph.valid[at] == 0) valid_[at] = 0;
      error_[at] += weight_ * static_cast<double>(one.left[at]);
      photograph_[at] += weight_ * static_cast<double>(one.photograph.mean[at]);
      variance_[at] += weight_ * weight_ * static_cast<double>(one.photograph.variance[at]);
      const GainLight light = gain.light(std::span(&weighted, 1), at);
      here_[at] += light.here;
      there_[at] += light.there;
    }
  }
}

void FloodSum::finish(EnergySums& to) const {
  for (std::size_t at = 0; at < error_.size(); ++at) {
    if (valid_[at] == 0) continue;
    const std::size_t t = at % to.pixels();
    to.add(t, error_[at], photograph_[at], photograph_[at] - error_[at], variance_[at]);
    to.add_error(t, here_[at] * there_[at]);
  }
}

namespace {

/// Mean of ‖T̃ z‖² over sparse random signs z, where they are dark.
double sparse_energy(const TransportTensor& tensor, const Work& work, double lit) {
  constexpr int kProbes = 48;
  // What one pass over the tensor applies, or fewer where their pictures are large.
  constexpr double kMostBytes = 64 << 20;
  const double bytes = static_cast<double>(tensor.camera_grid().size()) * tensor.channels() * sizeof(float);
  const int together = std::clamp(static_cast<int>(kMostBytes / bytes), 4, 16);
  constexpr std::uint64_t kSampleSeed = 0x5EA4C;
  const std::size_t pixels = tensor.camera_grid().size();
  Random random(kSampleSeed);
  std::vector<Image<float>> probes(static_cast<std::size_t>(together), Image<float>(tensor.camera_grid()));
  double energy = 0;
  for (int taken = 0; taken < kProbes; taken += together) {
    probes.resize(static_cast<std::size_t>(std::min(together, kProbes - taken)));
    for (Image<float>& z : probes)
      for (float& v : z.values()) {
        const float sign = random.sign();
        v = random.uniform() < lit ? sign : 0.F;
      }
    const auto seen = tensor.apply_batch(probes);
    if (!seen) return 0;
    work.add(std::ssize(probes) * operations_of_light(tensor));
    for (std::size_t k = 0; k < probes.size(); ++k)
      for (std::size_t at = 0; at < (*seen)[k].values().size(); ++at) {
        if (probes[k].values()[at % pixels] != 0) continue;
        const double y = (*seen)[k].values()[at];
        energy += y * y;
      }
  }
  return energy / kProbes;
}

}  // namespace

CheckSums::CheckSums(const TransportTensor& tensor, const GainMismatch& mismatch, std::size_t of_sets,
                     Work work)
    : ErrorSums(tensor.camera_tree(), of_sets),
      tensor_(tensor),
      mismatch_(mismatch),
      work_(std::move(work)),
      flood_(halves.pixels() * static_cast<std::size_t>(tensor.channels()), of_sets) {
  mean_sparse_energy = [this](double of_lit) {
    const double samples = static_cast<double>(halves.pixels()) * tensor_.channels();
    return sparse_energy(tensor_, work_, of_lit) / (samples * (1 - of_lit));
  };
}

void CheckSums::add(std::span<const TreePhotograph* const> photographs) {
  const std::vector<PagedVector<float>> left = left_by(tensor_, photographs, work_);
  std::vector<CheckResidual> set;
  set.reserve(left.size());
  for (std::size_t k = 0; k < left.size(); ++k) set.push_back({*photographs[k], left[k]});
  const GainError gain(tensor_, photographs, mismatch_);
  doubt_ = gain.doubt();
  if (added_ == 0) add_first(set, gain);
  ++added_;
  work_.add(kSumOperations * std::ssize(photographs) * std::ssize(photographs[0]->mean));
  add_signed_halves(set, gain, halves);
  flood_.add(set, gain);
  add_squares(set, gain,
              {{{Checks::kSparse, 1}, {Checks::kOtherSparse, -1}}, {Checks::kSparse, Checks::kOtherSparse}},
              sparse_pairs);
  for (const std::size_t one : {Checks::kHalf, Checks::kOtherHalf})
    add_squares(set, gain, {{{one, 1}}, {one}}, dark_halves);
  for (std::size_t t = 0; t < halves.pixels(); ++t)
    for (const std::size_t k : {Checks::kSparse, Checks::kOtherSparse})
      lit += photographs[k]->pattern[t] != 0 ? 1 : 0;
}

void CheckSums::add_first(Residuals set, const GainError& gain) {
  add_squares(set, gain, {{{Checks::kHalf, 1}}}, half);
  add_squares(set, gain, {{{Checks::kNatural, 1}}}, natural);
  add_squares(set, gain, {{{Checks::kBar, 1}}}, bar);
  add_squares(set, gain, {{{Checks::kBar, 1}}, {Checks::kBar}}, outside_bar);
  one_sided = one_sided_light(tensor_, set);
}

void CheckSums::finish() {
  assert(added_ == sets);
  flood_.finish(flood);
  lit /= static_cast<double>(halves.pixels() * sets);
  dark_share = 1 - lit;
  for (EnergySums* const sums :
       {&halves, &flood, &half, &natural, &bar, &outside_bar, &sparse_pairs, &dark_halves})
    sums->doubt_added(doubt_);
}

}  // namespace symrig::acquisition
