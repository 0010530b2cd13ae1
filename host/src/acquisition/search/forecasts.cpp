// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/forecasts.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

constexpr double kLeastGrowth = 0.95, kMostGrowth = 1.7;  // from one level to the next, in the mean
constexpr double kLeastMost = 1.35;                       // even where the last step was small
/// Level 1 has 16 photographs at most and nearly always that many: they say little of level 2.
constexpr double kLeastSecond = 1.8, kMostSecond = 4;
constexpr int kFirstGrowth = 3;  // the first level whose growth predicts the next
constexpr double kFull = 4;      // children of a block far from single pixels
constexpr double kAlone = 0.7;   // share of four photographs a block beyond which nothing is shared

double most_growth(const LevelPlan& plan) {
  if (plan.level < kFirstGrowth || plan.before < 1) return kMostGrowth;
  const double last = static_cast<double>(plan.planned) / static_cast<double>(plan.before);
  return std::clamp(1.1 * last, kLeastMost, kMostGrowth);
}

/// Photographs of later levels by a growth that is always the same.
double all_later(const LevelPlan& plan, double second, double growth) {
  const std::size_t level = plan.level;
  double photographs = static_cast<double>(plan.planned) * kFull / plan.children[level];
  double sum = 0;
  for (std::size_t k = level + 1; k < plan.children.size(); ++k) {
    photographs *= k == 2 ? second : growth;
    sum += photographs * plan.children[k] / kFull;
  }
  return sum;
}

bool shares_nothing(const LevelPlan& plan) {
  return plan.level >= kFirstGrowth &&
         static_cast<double>(plan.planned) >= kAlone * std::pow(4.0, plan.level + 1);
}

}  // namespace

std::vector<double> children_per_block(const BlockTree& tree) {
  std::vector<double> children;
  for (int l = 0; l + 1 < tree.levels(); ++l)
    children.push_back(static_cast<double>(tree.level(l + 1).size()) /
                       static_cast<double>(tree.level(l).size()));
  return children;
}

double photographs_if_growing(const LevelPlan& plan, double second, double growth) {
  if (plan.planned < 1 || static_cast<std::size_t>(plan.level) >= plan.children.size()) return 0;
  return static_cast<double>(plan.planned) + all_later(plan, second, growth);
}

double most_photographs(const LevelPlan& plan) {
  return photographs_if_growing(plan, kMostSecond, most_growth(plan));
}

UnitsToCome forecast_later(const LevelPlan& plan) {
  const bool known = plan.level >= 1 && static_cast<std::size_t>(plan.level) < plan.children.size();
  if (!known || plan.planned < 1 || shares_nothing(plan)) return {};
  const auto with_direct = [&plan](double later) {
    return later + plan.direct_share * (static_cast<double>(plan.taken) + later);
  };
  // Without noise no flood-lit photograph is taken at the end.
  return {std::llround(all_later(plan, kLeastSecond, kLeastGrowth)),
          std::llround(with_direct(all_later(plan, kMostSecond, most_growth(plan))))};
}

namespace {

constexpr int kMostOctaves = 40;  // below the flood-lit radiance, where nothing is foreseen
// Octaves of a part: fewer ask for more frames, and dim pixels are known better.
constexpr double kLitOctaves = 2;
constexpr double kDarkOctaves = 4;
constexpr double kAstray =
    0.2;  // share of pixels that get four times the light that is foreseen, or a quarter

/// An estimate gives the sum of the light, not where it goes.
void add_dark(float known, float unknown, LightHistogram& dark) {
  dark.add(known + unknown, 1 - 2 * kAstray);
  dark.add(known + 4 * unknown, kAstray);
  dark.add(known + unknown / 4, kAstray);
}

}  // namespace

ExposureForecast::ExposureForecast(const BlockTree& tree, const ExposureGoal& goal, const Radiance& flood,
                                   double sigma)
    : tree_(tree), goal_(goal), sigma_(sigma) {
  to_tree(tree, flood, flood_);
  const double brightest = *std::max_element(flood_.mean.begin(), flood_.mean.end());
  const double octaves = brightest > sigma ? std::ceil(std::log2(brightest / sigma)) : 0;
  const int last = static_cast<int>(std::min<double>(kMostOctaves, octaves));
  for (std::size_t t = 0; t < flood_.mean.size(); ++t) {
    if (flood_.valid[t] == 0) continue;
    for (int octave = 0; octave <= last; ++octave)
      anything_.add(std::ldexp(flood_.mean[t], -octave), 1.0 / (last + 1));
  }
}

std::vector<Expectation> ExposureForecast::expect(std::span<const LitBlocks> patterns,
                                                  std::span<const Preview> previews, SecondsEach most) const {
  std::vector<Expectation> expected(patterns.size());
  tbb::parallel_for(std::size_t{0}, patterns.size(), [&](std::size_t k) {
    expected[k] = expect_one(patterns[k], previews.empty() ? nullptr : &previews[k]);
    expected[k].most_seconds = most.photograph;
    expected[k].black_seconds = most.black;
  });
  return expected;
}

/// Parts of so many octaves, counted from the brightest down. Each must be known in relation to itself: the
/// dim pixels of a part hardly count beside its bright ones.
void ExposureForecast::add_parts(const LightHistogram& histogram, double relative, double octaves,
                                 Expectation& expected) const {
  const std::vector<ExpectedLight> lights = histogram.lights();
  const double sigma = coarseness_.factor() * sigma_;
  const double floor = sigma * sigma;
  ExpectedPart part;
  double squares = 0, pixels = 0;
  const auto finish = [&] {
    if (pixels <= 0) return;
    part.noise = floor + relative * relative * squares / pixels;
    expected.parts.push_back(std::move(part));
    part = {};
    squares = pixels = 0;
  };
  double brightest = 0;
  for (std::size_t k = lights.size(); k-- > 0;) {
    const ExpectedLight& light = lights[k];
    const bool below_floor = relative * brightest < sigma;  // such a part is known alike throughout
    if (pixels > 0 && !below_floor && light.radiance < brightest * std::exp2(-octaves)) finish();
    if (pixels <= 0) brightest = light.radiance;
    part.lights.push_back(light);
    squares += light.pixels * light.radiance * light.radiance;
    pixels += light.pixels;
  }
  finish();
}

Expectation ExposureForecast::expect_one(const LitBlocks& pattern, const Preview* preview) const {
  const std::size_t pixels = tree_.order().size();
  std::vector<char> lit(pixels);
  for (const LitRange& r : pattern) std::fill(lit.begin() + r.begin, lit.begin() + r.end, 1);
  LightHistogram bright, dark;
  for (std::size_t t = 0; t < flood_.mean.size(); ++t) {
    if (flood_.valid[t] == 0) continue;
    const float known = preview != nullptr ? std::max(0.0F, preview->known[t]) : 0;
    const float unknown = preview != nullptr ? std::max(0.0F, preview->unknown[t]) : flood_.mean[t];
    if (lit[t % pixels] != 0)
      bright.add(std::min(flood_.mean[t], known + unknown));
    else if (preview != nullptr)
      add_dark(known, unknown, dark);
  }
  Expectation expected;
  expected.longest_seconds = goal_.longest_seconds;
  expected.coarser_steps = coarseness_.steps;
  add_parts(bright, goal_.relative, kLitOctaves, expected);
  if (std::find(lit.begin(), lit.end(), 0) != lit.end())
    add_parts(preview != nullptr ? dark : anything_, goal_.relative_dark, kDarkOctaves, expected);
  return expected;
}

namespace {

/// Combs that show light of a few pixels' range, or the children of the whole grid.
constexpr double kFewestMore = 4;

/// I² of the channel that has most.
double light_between_pixels(const SearchFacts& facts, Checks& checks, const KnownTransport& nothing) {
  const std::vector<double> dark = Checks::misfit_of_half(checks.residuals(nothing));
  double most = 0;
  for (std::size_t channel = 0; channel < dark.size(); ++channel)
    if (facts.flood_squared[channel] > 0)
      most = std::max(most, 4 * dark[channel] / facts.flood_squared[channel]);  // half of the pixels are lit
  return most;
}

/// Of the whole capture, without budgets.
double photographs_needed(const SearchFacts& facts, double light_squared) {
  const auto pixels = static_cast<double>(facts.tree.grid().size());
  return 3.7 * std::pow(pixels, 1.0 / 4) * std::pow(light_squared / facts.tolerance(), 1.0 / 6);
}

}  // namespace

CaptureForecast forecast_capture(const SearchFacts& facts, Checks& checks, const KnownTransport& nothing,
                                 const SpentBefore& spent) {
  const CaptureSettings& options = facts.options;
  const auto taken = static_cast<double>(spent.photographs);
  const auto brute_force = static_cast<double>(facts.tree.grid().size());
  const double light_squared = light_between_pixels(facts, checks, nothing);
  const double least = light_squared > 0 ? taken + kFewestMore : taken;
  double all = std::clamp(photographs_needed(facts, light_squared), least, std::max(least, brute_force));
  if (options.max_patterns > 0) all = std::min(all, static_cast<double>(options.max_patterns));
  double seconds = spent.rig_seconds + (all - taken) * spent.seconds_each;
  if (options.max_seconds > 0 && seconds > options.max_seconds) {
    seconds = options.max_seconds;
    if (spent.seconds_each > 0) all = taken + std::max(0.0, seconds - spent.rig_seconds) / spent.seconds_each;
  }
  return {std::llround(all), seconds};
}

}  // namespace symrig::acquisition
