// SPDX-License-Identifier: Apache-2.0
#include "acquisition/errors/checks.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace symrig::acquisition {
namespace {

constexpr std::uint64_t kSeed = 0xC4EC;
constexpr double kSignificant = 3;  // standard deviations
constexpr std::size_t kChecks = Checks::kCount;
constexpr auto kHalf = Checks::kHalf, kOtherHalf = Checks::kOtherHalf, kSparse = Checks::kSparse,
               kOtherSparse = Checks::kOtherSparse, kBar = Checks::kBar, kNatural = Checks::kNatural;
constexpr std::array<const char*, kChecks> kNames{
    "random half", "its complement", "random 1/32", "another 1/32", "bar", "picture"};

/// Tree ranges of the pixels that are lit.
LitBlocks ranges_of(const BlockTree& tree, const std::vector<char>& lit_raster) {
  LitBlocks ranges;
  for (std::int32_t t = 0; t < std::ssize(tree.order()); ++t) {
    if (lit_raster[tree.order()[t]] == 0) continue;
    if (!ranges.empty() && ranges.back().end == t)
      ++ranges.back().end;
    else
      ranges.push_back({t, t + 1});
  }
  return ranges;
}

std::vector<char> above(const Image<float>& picture, float level) {
  std::vector<char> lit;
  for (const float v : picture.values()) lit.push_back(v > level ? 1 : 0);
  return lit;
}

/// The two halves and the sparse pair of one set.
std::vector<std::vector<char>> random_pixels(Grid grid, std::uint64_t seed) {
  const std::size_t pixels = grid.size();
  std::vector<std::vector<char>> lit(Checks::kFurther, std::vector<char>(pixels));
  Random random(seed);
  for (std::size_t i = 0; i < pixels; ++i) {
    const double u = random.uniform();
    lit[u < 0.5 ? kHalf : kOtherHalf][i] = 1;
    const double v = random.uniform();
    if (v < 1.0 / 16) lit[v < 1.0 / 32 ? kSparse : kOtherSparse][i] = 1;
  }
  return lit;
}

std::vector<std::vector<char>> lit_pixels(Grid grid) {
  std::vector<std::vector<char>> lit = random_pixels(grid, kSeed);
  lit.resize(kChecks);
  lit[kBar] = above(bar_pattern(grid), 0);
  const Image<float> picture = natural_pattern(grid, kSeed);
  std::vector<float> values(picture.values().begin(), picture.values().end());
  lit[kNatural] = above(picture, median(values));
  return lit;
}

/// Squares of a signed sum of check photographs, over the pixels that count.
struct CheckSquares {
  double error = 0, photograph = 0, noise = 0, noise_squared = 0;

  void add(double e, double y, double variance) {
    error += e * e;
    photograph += y * y;
    noise += variance;
    noise_squared += 2 * variance * variance;
  }
  double relative() const {
    const double resolution = std::sqrt(noise_squared);
    const double signal = photograph - noise;
    if (signal <= kSignificant * resolution) return 0;  // nothing to be relative to
    return std::sqrt(std::max({error - noise, resolution, 0.0}) / signal);
  }
};

}  // namespace

Result<Checks> Checks::take(const BlockTree& tree, Photographer& photographer) {
  Checks checks;
  checks.first_ = photographer.taken();
  const double before = photographer.rig_seconds();
  std::vector<LitBlocks> patterns;
  for (const auto& lit : lit_pixels(tree.grid())) patterns.push_back(ranges_of(tree, lit));
  SYMRIG_CHECK(photographer.take("checks", patterns, [&](std::int64_t, std::span<TreePhotograph> taken) {
    for (const TreePhotograph& photograph : taken) checks.residuals_.push_back({photograph, photograph.mean});
  }));
  checks.seconds_each_ = (photographer.rig_seconds() - before) / static_cast<double>(kCount);
  return checks;
}

Result<Checks> Checks::of_log(const Photographer& photographer, LogRange six, std::vector<LogRange> further) {
  Checks checks;
  checks.first_ = six.first;
  checks.further_ranges_ = std::move(further);
  SYMRIG_CHECK(photographer.read(six.first, kCount, [&](std::int64_t, std::span<TreePhotograph> read) {
    for (const TreePhotograph& photograph : read) checks.residuals_.push_back({photograph, photograph.mean});
  }));
  return checks;
}

Result<void> Checks::take_further(std::int64_t sets, const BlockTree& tree, Photographer& photographer) {
  const std::int64_t first = photographer.taken();
  const std::uint64_t before = this->sets() - 1;
  std::vector<LitBlocks> patterns;
  for (std::uint64_t set = before; set < before + sets; ++set)
    for (const auto& lit : random_pixels(tree.grid(), kSeed + 1 + set))
      patterns.push_back(ranges_of(tree, lit));
  SYMRIG_CHECK(photographer.take("checks", patterns));
  further_ranges_.push_back({first, photographer.taken()});
  return {};
}

std::size_t Checks::sets() const {
  std::int64_t further = 0;
  for (const LogRange& range : further_ranges_) further += range.last - range.first;
  return static_cast<std::size_t>(1 + further / kFurther);
}

Result<void> Checks::visit_sets(const Photographer& photographer, const UseSet& use) const {
  std::vector<const TreePhotograph*> set;
  for (const Residual& one : residuals_) set.push_back(&one.photograph);
  use(set);
  const auto use_read = [&](std::int64_t, std::span<TreePhotograph> photographs) {
    set.clear();
    for (const TreePhotograph& one : photographs) set.push_back(&one);
    use(set);
  };
  for (const LogRange& range : further_ranges_)
    for (std::int64_t first = range.first; first < range.last; first += kFurther)
      SYMRIG_CHECK(photographer.read(first, kFurther, use_read, kFurther));
  return {};
}

std::vector<LogRange> Checks::ranges() const {
  std::vector<LogRange> ranges{{first_, last()}};
  ranges.insert(ranges.end(), further_ranges_.begin(), further_ranges_.end());
  return ranges;
}

const std::vector<Checks::Residual>& Checks::residuals(const KnownTransport& known) {
  if (rewritten_ != known.rewritten()) {
    for (Residual& one : residuals_) one.residual = one.photograph.mean;
    mark_ = {};
  }
  std::vector<TreePhotograph> left(residuals_.size());
  for (std::size_t k = 0; k < left.size(); ++k) {
    left[k].pattern = std::move(residuals_[k].photograph.pattern);
    left[k].mean = std::move(residuals_[k].residual);
  }
  known.subtract_from(left, mark_);
  for (std::size_t k = 0; k < left.size(); ++k) {
    residuals_[k].photograph.pattern = std::move(left[k].pattern);
    residuals_[k].residual = std::move(left[k].mean);
  }
  mark_ = known.mark();
  rewritten_ = known.rewritten();
  return residuals_;
}

std::vector<TreePhotograph> Checks::halves() const {
  std::vector<TreePhotograph> both(2);
  for (const std::size_t k : {kHalf, kOtherHalf}) {
    both[k].pattern = residuals_[k].photograph.pattern;
    both[k].mean = residuals_[k].residual;
  }
  return both;
}

TransportErrors Checks::errors(const std::vector<Residual>& residuals) {
  const std::size_t pixels = residuals[0].photograph.pattern.size();
  CheckSquares frobenius, flood, indirect, random, natural, bar, bar_outside;
  for (std::size_t at = 0; at < residuals[0].residual.size(); ++at) {
    const std::size_t t = at % pixels;
    const auto one = [&](std::size_t k, CheckSquares& into) {
      const TreePhotograph& p = residuals[k].photograph;
      if (p.valid[at] != 0) into.add(residuals[k].residual[at], p.mean[at], p.variance[at]);
    };
    // first + sign · second, both valid
    const auto two = [&](std::size_t first, std::size_t second, double sign, CheckSquares& into) {
      const TreePhotograph& p = residuals[first].photograph;
      const TreePhotograph& q = residuals[second].photograph;
      if (p.valid[at] != 0 && q.valid[at] != 0)
        into.add(residuals[first].residual[at] + sign * residuals[second].residual[at],
                 p.mean[at] + sign * q.mean[at], p.variance[at] + q.variance[at]);
    };
    two(kHalf, kOtherHalf, -1, frobenius);
    two(kHalf, kOtherHalf, 1, flood);
    if (residuals[kSparse].photograph.pattern[t] == 0 && residuals[kOtherSparse].photograph.pattern[t] == 0)
      two(kSparse, kOtherSparse, -1, indirect);
    one(kHalf, random);
    one(kNatural, natural);
    one(kBar, bar);
    if (residuals[kBar].photograph.pattern[t] == 0) one(kBar, bar_outside);
  }
  return {frobenius.relative(), indirect.relative(), flood.relative(),      bar.relative(),
          random.relative(),    natural.relative(),  bar_outside.relative()};
}

std::int64_t Checks::last() const {
  return first_ + static_cast<std::int64_t>(kChecks);
}

std::vector<double> Checks::misfit_of_half(const std::vector<Residual>& residuals) {
  const std::size_t pixels = residuals[0].photograph.pattern.size();
  std::vector<double> mean;
  for (std::size_t begin = 0; begin < residuals[0].residual.size(); begin += pixels) {
    CheckSquares dark;
    double samples = 0;
    for (const std::size_t k : {kHalf, kOtherHalf}) {
      const TreePhotograph& p = residuals[k].photograph;
      for (std::size_t t = 0; t < pixels; ++t) {
        if (p.pattern[t] != 0 || p.valid[begin + t] == 0) continue;
        dark.add(residuals[k].residual[begin + t], p.mean[begin + t], p.variance[begin + t]);
        ++samples;
      }
    }
    mean.push_back(samples > 0 ? std::max(0.0, dark.error - dark.noise) / samples : 0);
  }
  return mean;
}

Result<std::vector<HeldOut>> Checks::held_out(const BlockTree& tree, const Photographer& photographer) const {
  std::vector<HeldOut> photographs;
  const auto raster = [&](std::span<const float> values) {
    const std::size_t pixels = tree.order().size();
    const auto channels = static_cast<int>(values.size() / pixels);
    Image<float> image(tree.grid(), channels);
    for (int channel = 0; channel < channels; ++channel)
      tree.to_raster(values.subspan(static_cast<std::size_t>(channel) * pixels, pixels),
                     image.plane(channel));
    return image;
  };
  int number = 0;  // of the set
  SYMRIG_CHECK(visit_sets(photographer, [&](std::span<const TreePhotograph* const> set) {
    ++number;
    for (std::size_t k = 0; k < set.size(); ++k) {
      std::string name = kNames[k];
      if (number > 1) name += ", set " + std::to_string(number);
      photographs.push_back({std::move(name), raster(set[k]->pattern), raster(set[k]->mean)});
    }
  }));
  return photographs;
}

DarkExcess::DarkExcess(std::span<const Checks::Residual> residuals, std::span<const double> flood_squared) {
  const std::size_t pixels = residuals[0].photograph.pattern.size();
  before_.resize(pixels + 1);
  lit_before_.assign(residuals.size(), std::vector<double>(pixels + 1));
  for (std::size_t t = 0; t < pixels; ++t) {
    Comparison sum = before_[t];
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      const TreePhotograph& p = residuals[k].photograph;
      lit_before_[k][t + 1] = lit_before_[k][t] + static_cast<double>(p.pattern[t]);
      if (p.pattern[t] != 0) continue;
      for (std::size_t channel = 0; channel < flood_squared.size(); ++channel) {
        const std::size_t at = channel * pixels + t;
        if (p.valid[at] == 0 || flood_squared[channel] <= 0) continue;
        const double e = residuals[k].residual[at];
        const double y = p.mean[at];
        sum += {e * e / flood_squared[channel], y * y / flood_squared[channel],
                static_cast<double>(p.variance[at]) / flood_squared[channel], 1};
      }
    }
    before_[t + 1] = sum;
  }
}

Comparison DarkExcess::of(std::int32_t begin, std::int32_t end) const {
  const Comparison& a = before_[begin];
  const Comparison& b = before_[end];
  return {b.misfit - a.misfit, b.signal - a.signal, b.noise - a.noise, b.samples - a.samples};
}

double DarkExcess::lit(std::size_t check, std::int32_t begin, std::int32_t end) const {
  return lit_before_[check][end] - lit_before_[check][begin];
}

}  // namespace symrig::acquisition
