// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/exposure_forecast.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {
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
                                                  std::span<const Preview> previews) const {
  std::vector<Expectation> expected(patterns.size());
  tbb::parallel_for(std::size_t{0}, patterns.size(), [&](std::size_t k) {
    expected[k] = expect_one(patterns[k], previews.empty() ? nullptr : &previews[k]);
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

}  // namespace symrig::acquisition
