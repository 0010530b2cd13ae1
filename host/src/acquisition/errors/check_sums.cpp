// SPDX-License-Identifier: Apache-2.0
#include "acquisition/errors/check_sums.hpp"

#include "symrig/image/image.hpp"

#include <algorithm>
#include <cassert>
#include <utility>
#include <vector>

namespace symrig::acquisition {
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

CheckSums::CheckSums(const TransportTensor& tensor, const GainMismatch& mismatch, std::size_t sets, Work work)
    : halves(static_cast<std::size_t>(tensor.camera_grid().size())),
      flood(halves.pixels()),
      half(halves.pixels()),
      natural(halves.pixels()),
      bar(halves.pixels()),
      outside_bar(halves.pixels()),
      sparse_pairs(halves.pixels()),
      dark_halves(halves.pixels()),
      tensor_(tensor),
      mismatch_(mismatch),
      work_(std::move(work)),
      sets_(sets),
      flood_(halves.pixels() * static_cast<std::size_t>(tensor.channels()), sets) {}

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
  assert(added_ == sets_);
  flood_.finish(flood);
  lit /= static_cast<double>(halves.pixels() * sets_);
  for (EnergySums* const sums :
       {&halves, &flood, &half, &natural, &bar, &outside_bar, &sparse_pairs, &dark_halves})
    sums->doubt_added(doubt_);
}

}  // namespace symrig::acquisition
