// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_tests.hpp"
#include "symrig/hdr/bracket_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::acquisition {
namespace {

/// Less is what lamps do within seven photographs; the noise check reports it (NoiseCheck).
constexpr double kLittle = 0.005;
/// More than this is refused even if no cause fits.
constexpr double kMuch = 0.1;
/// A share of the pixels at the largest value.
constexpr double kPiled = 0.05;
/// A lamp whose light changes by more spoils every photograph.
constexpr double kFlickers = 0.1;

double light_of(const Radiance& photograph) {
  double sum = 0;
  for (const float v : photograph.mean.values()) sum += static_cast<double>(v);
  return sum;
}

struct LightRatio {
  double value = 0, sigma = 0;
};

/// The light of the pixels that two patterns light, over the light that they have in the flood-lit
/// photograph.
LightRatio lit_over_flood(const LightSeries& series, std::size_t a, std::size_t b) {
  double light = 0, all = 0, variance = 0;
  for (const std::size_t k : {a, b})
    for (std::size_t at = 0; at < series.valid().size(); ++at) {
      if (series.valid()[at] == 0 || series[k].lit[at] == 0) continue;
      light += series[k].mean[at];
      all += series[LightSeries::kFlood].mean[at];
      variance += static_cast<double>(series[k].variance[at]) + series[LightSeries::kFlood].variance[at];
    }
  return all > 0 ? LightRatio{light / all, std::sqrt(variance) / all} : LightRatio{};
}

LightCause curved(double exponent) {
  return {
      fmt::format("a camera that is not linear: with its values to the power of {:.2g}, the light adds up",
                  exponent),
      "switch off gamma, tone curves and contrast of the camera"};
}

LightCause flickering(double scatter) {
  return {fmt::format("a lamp that flickers: photographs of the same pattern differ by {}",
                      percent_of_light(scatter)),
          "expose for whole periods of the lamp, or use a steady lamp"};
}

/// The share of the pixels of the flood-lit photograph that have its largest value.
double largest_share(const LightSeries& series) {
  float most = 0;
  std::int64_t equal = 0;
  for (std::size_t at = 0; at < series.valid().size(); ++at) {
    if (series.valid()[at] == 0) continue;
    const float light = series[LightSeries::kFlood].mean[at];
    if (light > most) most = light, equal = 0;
    if (light == most) ++equal;
  }
  return static_cast<double>(equal) / static_cast<double>(series.pixels());
}

LightCause clipping(double share) {
  return {fmt::format(
              "a camera or a merge that clips, and says that the pixels are valid: {} of them have the same "
              "largest value",
              percent_of_light(share)),
          "expose shorter, and state clipped pixels as not valid"};
}

/// All light together is to be known to a twentieth of what is looked for. A rig that is told nothing exposes
/// the dark photograph as long as it may.
Expectation expected_even_light(const LightSeries& series) {
  constexpr double kShare = 0.05, kMost = 0.02;  // of kLittle; of the light of a pixel
  LightHistogram light;
  for (const float v : series[LightSeries::kFlood].mean) light.add(std::max(v, 0.F));
  if (!(light.mean_square() > 0)) return {};
  const double relative = std::min(kMost, kShare * kLittle * std::sqrt(light.pixels()));
  Expectation expected;
  expected.parts = {{light.lights(), relative * relative * light.mean_square()}};
  return expected;
}

}  // namespace

LeftOver::LeftOver(const LightSeries& series) : series_(series) {
  const LightSeries::Sum flood = series.sum(LightSeries::kFlood), half = series.sum(LightSeries::kHalf),
                         other = series.sum(LightSeries::kOtherHalf);
  if (!(flood.value > 0)) return;
  share_ = (half.value + other.value - flood.value) / flood.value;
  sigma_ = std::hypot(half.sigma, other.sigma, flood.sigma) / flood.value;
  double squares = 0;
  for (std::size_t at = 0; at < series.valid().size(); ++at)
    if (series.valid()[at] != 0)
      squares +=
          static_cast<double>(series[LightSeries::kFlood].mean[at]) * series[LightSeries::kFlood].mean[at];
  if (squares > 0) noise_ = std::pow(sigma_ * flood.value, 2) / squares;
}

/// use(H^g + H'^g − F^g, F^g) for each pixel.
template <class Use>
void LeftOver::for_each_pixel(double exponent, const Use& use) const {
  const auto power = [&](std::size_t k, std::size_t at) {
    return std::pow(std::max(0.0, static_cast<double>(series_[k].mean[at])), exponent);
  };
  for (std::size_t at = 0; at < series_.valid().size(); ++at) {
    if (series_.valid()[at] == 0) continue;
    const double flood = power(LightSeries::kFlood, at);
    use(power(LightSeries::kHalf, at) + power(LightSeries::kOtherHalf, at) - flood, flood);
  }
}

double LeftOver::raised(double exponent) const {
  double over = 0, all = 0;
  for_each_pixel(exponent, [&](double left, double flood) { over += left, all += flood; });
  return all > 0 ? over / all : 0;
}

/// The rms of the same, pixel by pixel, over that of the light, less noise.
double LeftOver::rms(double exponent) const {
  double over = 0, all = 0;
  for_each_pixel(exponent, [&](double left, double flood) { over += left * left, all += flood * flood; });
  return all > 0 ? std::sqrt(std::max(0.0, over / all - noise_)) : 0;
}

std::optional<double> LeftOver::exponent() const {
  constexpr double kLargest = 4, kFits = 0.4;
  constexpr int kSteps = 30;
  // A larger exponent leaves less: bright light gains on weak light.
  double low = share_ > 0 ? 1 : 1 / kLargest, high = share_ > 0 ? kLargest : 1;
  if (raised(high) > 0 || raised(low) < 0) return std::nullopt;
  for (int step = 0; step < kSteps; ++step) {
    const double middle = std::sqrt(low * high);
    (raised(middle) > 0 ? low : high) = middle;
  }
  return rms(low) < kFits * rms(1) ? std::optional(low) : std::nullopt;
}

Result<BlackAndWhite> look_at_black_and_white(const LightSeries& series, const LookAside& look) {
  BlackAndWhite found;
  if (!look) return found;
  std::vector<Pattern> patterns(6, Pattern(series.grid()));
  for (std::size_t k = 1; k < patterns.size(); ++k) std::ranges::fill(patterns[k].values(), 1.0F);
  const std::vector<Expectation> expected(patterns.size(), expected_even_light(series));
  SYMRIG_TRY(const std::vector<Radiance> seen, look(patterns, expected));
  if (seen.size() != patterns.size()) return found;
  const LightSeries::Sum flood = series.sum(LightSeries::kFlood);
  double variance = 0, below = 0;
  for (const float v : seen[0].variance.values()) variance += static_cast<double>(v);
  for (const float v : seen[0].mean.values()) below += v < 0 ? 1 : 0;
  found.known = true;
  found.black = light_of(seen[0]) / flood.value;
  found.black_sigma = std::sqrt(variance) / flood.value;
  found.negative = below / static_cast<double>(seen[0].mean.values().size());
  double least = light_of(seen[1]), most = least;
  for (std::size_t k = 2; k < seen.size(); ++k) {
    least = std::min(least, light_of(seen[k]));
    most = std::max(most, light_of(seen[k]));
  }
  // A light that goes on and off has a middle; the first photograph may be far from it.
  found.scatter = most > 0 ? (most - least) / most : 0;
  return found;
}

std::optional<LightFault> find_automatic(const LightSeries& series) {
  constexpr double kMore = 1.3;
  const LightRatio half = lit_over_flood(series, LightSeries::kHalf, LightSeries::kOtherHalf),
                   sparse = lit_over_flood(series, LightSeries::kSparse, LightSeries::kOtherSparse);
  if (sparse.value < std::max(kMore, 1 + kLightSigmas * sparse.sigma) || sparse.value < half.value)
    return std::nullopt;
  return LightFault{
      fmt::format(
          "pixels are {:.2g} times as bright if 1/32 of them are lit, and {:.2g} times if half of them are, "
          "as if all are lit",
          sparse.value, half.value),
      {{"automatic exposure or automatic gain of the camera", "fix exposure and gain"},
       {"an automatic iris or dynamic contrast of the projector", ""}}};
}

Result<std::optional<LightFault>> find_wrong_brightness(const LightSeries& series, const LightMatch& match,
                                                        const LookAside& look) {
  if (auto automatic = find_automatic(series)) return automatic;
  const LeftOver over(series);
  if (std::abs(over.share()) < std::max(kLittle, kLightSigmas * over.sigma()))
    return std::optional<LightFault>();
  SYMRIG_TRY(const BlackAndWhite aside, look_at_black_and_white(series, look));
  LightFault fault{
      fmt::format("the light does not add up: the photographs of two halves together have {}{} of "
                  "the light that all pixels give",
                  over.share() > 0 ? "+" : "", percent_of_light(over.share())),
      {}};
  const bool other = aside.known &&
                     std::abs(aside.black) > std::max(kLittle / 3, kLightSigmas * aside.black_sigma) &&
                     std::abs(aside.black) > 0.3 * std::abs(over.share());
  if (other) fault.causes.push_back(other_light(aside.black));
  if (other && !match.follows())
    fault.causes.push_back(
        {fmt::format(
             "light of other patterns, which {} pixels cannot tell: a camera that is late, or a projector "
             "that is not settled or shows black for white",
             series.pixels()),
         "capture with --algorithm brute, which tells"});
  // Where nothing can be asked, light of other sources looks much like a curve.
  if (!aside.known)
    fault.causes.push_back({"light of other sources, or a wrong black level",
                            "cover the rig, and subtract a photograph of the dark projector"});
  const bool flickers = aside.known && aside.scatter > std::max(kLittle, 0.3 * std::abs(over.share()));
  if (flickers) fault.causes.push_back(flickering(aside.scatter));
  const double at_most = largest_share(series);
  if (!other && !flickers && over.share() > kMuch && at_most > kPiled)
    fault.causes.push_back(clipping(at_most));
  const auto exponent = over.exponent();
  if (fault.causes.empty() && !exponent) {
    if (over.share() > 0)
      fault.causes.push_back({"clipped light that the camera does not mark", "shorten the exposures"});
    fault.causes.push_back({"more noise than photographs state", "expose longer, or state the noise"});
    fault.causes.push_back({"automatic exposure or gain of the camera", "fix both"});
  }
  if (!other && !flickers && exponent) fault.causes.push_back(curved(*exponent));
  // Errors contain what a lamp does that flickers a little.
  const bool little = std::abs(over.share()) < kMuch || (flickers && aside.scatter < kFlickers);
  const bool sure = other || (exponent && !flickers);
  if (!sure && little) return std::optional<LightFault>();
  return std::optional(std::move(fault));
}

}  // namespace symrig::acquisition
