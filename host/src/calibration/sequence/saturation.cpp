// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence/sequence_verdicts.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

constexpr double kMostSaturated = 0.02;  // of the lit pixels

/// The values of white's sample, from its brightest channel.
std::vector<float> white_of(const SequenceLight& light) {
  const CodePhotographs& all = light.photographs;
  const auto values = (all.white_peak.empty() ? all.white() : all.white_peak).values();
  std::vector<float> white;
  white.reserve(light.sample.size());
  for (const std::size_t i : light.sample) white.push_back(values[i]);
  return white;
}

template <class Test>
double share_of(const std::vector<float>& values, const Test& test) {
  return static_cast<double>(std::ranges::count_if(values, test)) / static_cast<double>(values.size());
}

/// How often a value is the same again.
struct Repeats {
  double same = 0, all = 0;

  void add(bool is_same) { same += is_same ? 1 : 0, all += 1; }
  double share() const { return all > 0 ? same / all : 1; }
};

/// A value at which pixels stand, and by how much they may differ from it.
struct Pile {
  float value, within;

  bool holds(float v) const { return std::abs(v - value) <= within; }
};

/// Calls use(lit, dark) with the values of a pixel for each of its pairs, without those whose stripes are
/// blurred there.
template <class Use>
void for_sharp_pairs(const SequenceLight& light, std::size_t pixel, const Use& use) {
  constexpr float kSharp = 0.8F;  // of the largest contrast
  float contrast = 0;
  for (const int pair : light.pairs) contrast = std::max(contrast, std::abs(light.difference(pair, pixel)));
  for (const int pair : light.pairs) {
    const float p = light.of(2 * pair, pixel), n = light.of(2 * pair + 1, pixel);
    if (std::abs(p - n) < kSharp * contrast) continue;
    // A complement that was computed is no photograph.
    if (!light.photographs.complements_derived || p > n) use(std::max(p, n), std::min(p, n));
  }
}

/// Whether pixels stand at this value without noise, while others change.
bool stands_still(const SequenceLight& light, const std::vector<float>& white, const Pile& pile) {
  constexpr double kStill = 0.9, kMoving = 0.6, kFewest = 200;
  const auto black = light.photographs.black().values();
  double still = 0, at_pile = 0;
  Repeats darker, unlit;
  for (std::size_t k = 0; k < white.size(); ++k) {
    const std::size_t i = light.sample[k];
    const bool inside = pile.holds(white[k]);
    Repeats own;
    for_sharp_pairs(light, i, [&](float lit, float dark) {
      own.add(std::abs(lit - white[k]) <= pile.within);
      if (inside) unlit.add(std::abs(dark - black[i]) <= pile.within);
    });
    if (own.all == 0) continue;
    if (!inside) darker.same += own.same, darker.all += own.all;
    if (inside) at_pile += 1, still += own.share() >= kStill ? 1 : 0;
  }
  const auto moves = [](const Repeats& of) { return of.all >= kFewest && of.share() <= kMoving; };
  return still > kMostSaturated * static_cast<double>(white.size()) && 2 * still >= at_pile &&
         (moves(darker) || moves(unlit));
}

Error saturated(const SequenceLight& light, double share, const std::string& where) {
  return {ErrorCode::bad_value,
          fmt::format("{} (white) is saturated in {:.0f} % of the pixels that the projector lights{}",
                      light.name(light.photographs.code.white()), 100 * share, where),
          "photograph the sequence again with a shorter exposure"};
}

/// The value that two in a thousand exceed: stuck pixels may be brighter.
float top_of(std::vector<float> white) {
  constexpr double kBrightest = 0.998;
  return quantile(white, kBrightest);
}

/// The pile at the top. Wells that are full before they are read out stand at one value but for read noise.
std::optional<Pile> pile_at_top(const SequenceLight& light, const std::vector<float>& white) {
  const float top = top_of(white);
  for (const float width : {1e-6F, 1e-3F, 3e-3F}) {
    const float within = width * top;
    std::vector<float> near;
    for (const float v : white)
      if (v <= top + within && v >= top - 2 * within) near.push_back(v);
    if (near.empty()) continue;
    const Pile pile{median(near), within};
    if (share_of(white, [&](float v) { return pile.holds(v); }) <= kMostSaturated) continue;
    if (stands_still(light, white, pile)) return pile;
  }
  return {};
}

/// Pixels that stand at white's top value although the sums of their pairs tell that they differ: white alone
/// was exposed for longer.
std::optional<Pile> pile_in_white_alone(const SequenceLight& light, const std::vector<float>& white) {
  constexpr double kSpread = 0.02, kGaps = 3, kSigmas = 5;  // of the value, of the codes' distance, of noise
  constexpr double kLow = 0.1, kHigh = 0.9;
  const Pile pile{top_of(white), 0};
  float below = 0;
  std::vector<float> excess;
  double sigma = 0;
  for (std::size_t k = 0; k < white.size(); ++k) {
    if (white[k] < pile.value) below = std::max(below, white[k]);
    if (!pile.holds(white[k])) continue;
    const std::size_t i = light.sample[k];
    std::vector<float> sums;
    sums.reserve(light.pairs.size());
    for (const int pair : light.pairs) sums.push_back(light.sum(pair, i));
    excess.push_back(median(sums) - white[k] - light.photographs.black().values()[i]);
    sigma = std::max(sigma, light.sigma(i));  // noise alone spreads over 3.8 of them
  }
  if (static_cast<double>(excess.size()) <= kMostSaturated * static_cast<double>(white.size())) return {};
  const auto value = static_cast<double>(pile.value), gap = value - static_cast<double>(below);
  const float low = quantile(excess, kLow), high = quantile(excess, kHigh);
  const double least = std::max({kSpread * value, kGaps * gap, kSigmas * sigma});
  return static_cast<double>(high - low) > least ? std::optional(pile) : std::nullopt;
}

}  // namespace

std::optional<std::string> largest_code_at(float value) {
  constexpr double kRounding = 0.01;  // of codes; a float knows 65535 to 0.004
  for (const int stored : {16, 14, 12, 10}) {
    const int largest = (1 << stored) - 1;
    const double code = static_cast<double>(value) * largest;
    const auto whole = static_cast<int>(std::lround(code));
    if (std::abs(code - whole) > kRounding) continue;
    for (int bits = 8; bits < stored; ++bits)
      if (const int own = (1 << bits) - 1; whole == own || whole == own << (stored - bits))
        return fmt::format("code {} of {}, the largest of {} bits", whole, largest, bits);
  }
  return {};
}

Result<void> check_saturation(const SequenceLight& light) {
  const std::vector<float> white = white_of(light);
  const auto at = [&](float value) {
    return share_of(white, [&](float v) { return std::abs(v - value) <= 1e-6F * value; });
  };
  // Light in floating point has exactly this value only by chance.
  const float full = light.photographs.saturation;
  const double share = std::isfinite(full) ? at(full) : 0;
  const auto stated = full < 1 ? largest_code_at(full) : std::nullopt;
  if (share > kMostSaturated)
    return saturated(light, share, stated ? fmt::format(": they stand at {}", *stated) : "");
  const float top = top_of(white);
  const auto name = largest_code_at(top);
  if (name && at(top) > kMostSaturated)
    return saturated(light, at(top), fmt::format(": they stand at {}", *name));
  if (!light.photographs.white_peak.empty()) return {};  // the patterns' channels are not kept
  const auto describe = [&](const Pile& pile, const char* why) {
    return saturated(light, share_of(white, [&](float v) { return pile.holds(v); }),
                     fmt::format(": they stand at {:.4g} of the file's largest code, {}",
                                 static_cast<double>(pile.value), why));
  };
  if (const auto pile = pile_in_white_alone(light, white))
    return describe(*pile, "although their patterns differ");
  if (const auto pile = pile_at_top(light, white)) return describe(*pile, "without noise");
  return {};
}

}  // namespace symrig::calibration
