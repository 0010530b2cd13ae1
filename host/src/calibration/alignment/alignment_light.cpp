// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_check.hpp"
#include "calibration/alignment/coarse_code.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

using acquisition::kLightSigmas;
using acquisition::LightFault;
using acquisition::percent_of_light;
using acquisition::Turn;

/// The light of each photograph, and what parts it from the one before.
class CodeLight {
 public:
  CodeLight(const CoarseCode& code, std::span<const Radiance> photographs, int channel)
      : white_(code.white()), black_(code.black()) {
    const auto of_white = photographs[white_].mean.plane(channel);
    // A pixel that is too bright in white counts in no photograph.
    std::vector<std::uint8_t> counts(of_white.size(), 1);
    for (const Radiance& photograph : photographs)
      for (std::size_t at = 0; at < counts.size(); ++at) counts[at] &= photograph.valid.plane(channel)[at];
    pixels_ = std::ranges::count(counts, std::uint8_t{1});
    for (std::size_t k = 0; k < photographs.size(); ++k) {
      sums_.push_back(0), variances_.push_back(0), changes_.push_back(0);
      double apart = 0, light = 0;
      const auto mean = photographs[k].mean.plane(channel), variance = photographs[k].variance.plane(channel);
      for (std::size_t at = 0; at < mean.size(); ++at) {
        if (counts[at] == 0) continue;
        sums_[k] += static_cast<double>(mean[at]), variances_[k] += static_cast<double>(variance[at]);
        const double white = of_white[at], off = static_cast<double>(mean[at]) - white;
        apart += off * off - static_cast<double>(variance[at]), light += white * white;
        if (k == 0) continue;
        const double change =
            static_cast<double>(mean[at]) - static_cast<double>(photographs[k - 1].mean.plane(channel)[at]);
        changes_[k] += change * change;
      }
      from_white_.push_back(light > 0 ? apart / light : 0);
    }
  }

  std::size_t count() const { return sums_.size(); }
  std::int64_t pixels() const { return pixels_; }
  double white() const { return sums_[white_] - sums_[black_]; }
  double noise() const { return std::sqrt(variances_[white_] + variances_[black_]); }
  double light(std::size_t k) const { return sums_[k]; }
  /// The photographs of bits come first; both of their halves are many blocks.
  std::size_t bits() const { return white_; }
  std::size_t of_black() const { return black_; }
  std::size_t of_white() const { return white_; }
  /// Where photograph `k` stands between black (0) and white (1).
  double share(std::size_t k) const { return (sums_[k] - sums_[black_]) / white(); }
  double least() const { return *std::ranges::min_element(sums_); }
  double most() const { return *std::ranges::max_element(sums_); }
  /// Squares of what parts photograph `k` from white, over those of white, less noise.
  double from_white(std::size_t k) const { return from_white_[k]; }
  /// Squares of what changed from the photograph before.
  double change(std::size_t k) const { return changes_[k]; }
  double variance(std::size_t k) const { return variances_[k] + (k > 0 ? variances_[k - 1] : 0); }

 private:
  std::size_t white_, black_;
  std::int64_t pixels_ = 0;
  std::vector<double> sums_, variances_, changes_, from_white_;
};

std::optional<LightFault> find_dark(const CodeLight& light) {
  for (std::size_t k = 0; k < light.count(); ++k)
    if (std::abs(light.light(k)) > kLightSigmas * std::sqrt(light.variance(k))) return std::nullopt;
  return LightFault{"all photographs are dark: white gives no light above the noise",
                    {{"a cap on the lens or a closed iris", "let light reach the camera"},
                     {"a lamp or a projector that is off", ""},
                     {"a scene that is black", ""}}};
}

std::optional<LightFault> find_alike(const CodeLight& light) {
  constexpr double kAlike = 0.1, kRepeats = 0.1;
  if (light.most() <= 0 || light.most() - light.least() > kAlike * light.most()) return std::nullopt;
  double changed = 0, noise = 0;
  for (std::size_t k = 1; k < light.count(); ++k) changed += light.change(k), noise += light.variance(k);
  LightFault fault{fmt::format("all photographs are equally bright, within {}, also those of black and white",
                               percent_of_light(1 - light.least() / light.most())),
                   {}};
  const bool repeats = changed <= kRepeats * noise, structured = changed > 4 * noise;
  if (repeats)
    fault.causes = {{"the camera gives the same photograph again and again",
                     "check that it takes a new photograph for each trigger"},
                    {"the projector does not change its picture", ""}};
  else if (structured)
    fault.causes = {{"automatic exposure or automatic gain of the camera: the pictures change all the same",
                     "fix exposure and gain"}};
  else
    fault.causes = {
        {"the projector's light does not reach the camera, and other light does (the lamp is off, the "
         "room is lit)",
         "switch the lamp on, and cover the rig"},
        {"the projector does not change its picture", ""},
        {"a camera that looks at something that is not lit", ""}};
  return fault;
}

/// Bits are as bright as white, and are not white: they light about half of the cells.
std::optional<LightFault> find_automatic(const CodeLight& light) {
  constexpr double kEqual = 0.1, kOther = 0.05;
  if (light.white() <= kLightSigmas * light.noise()) return std::nullopt;
  std::size_t equal = 0;
  for (std::size_t k = 0; k < light.bits(); ++k)
    equal += std::abs(light.share(k) - 1) < kEqual && light.from_white(k) > kOther ? 1 : 0;
  if (2 * equal <= light.bits()) return std::nullopt;
  return LightFault{
      fmt::format("{} photographs of stripes are as bright as that of white, although stripes light "
                  "about half of the cells",
                  equal),
      {{"automatic exposure or automatic gain of the camera", "fix exposure and gain"},
       {"an automatic iris or dynamic contrast of the projector", ""}}};
}

/// Black is brighter than white. If photographs come one late, that of black shows white, and that of white
/// half.
std::optional<LightFault> find_black_brighter(const CodeLight& light) {
  if (light.white() > -kLightSigmas * light.noise()) return std::nullopt;
  const double range = light.most() - light.least(),
               white = (light.light(light.of_white()) - light.least()) / range;
  constexpr double kDarkest = 0.15;
  LightFault fault{
      fmt::format("the photograph of black is brighter than that of white, which stands at {} between the "
                  "darkest photograph and the brightest one",
                  percent_of_light(white)),
      {}};
  if (white < kDarkest)
    fault.causes = {{"the projector shows black for white", "switch off the inversion of the projector"}};
  else
    fault.causes = {{"photographs come late or twice: each shows the pattern before it",
                     "empty the camera's queue before each pattern, and wait until the pattern is shown"}};
  return fault;
}

/// A bit that looks as the bit before, although both light a part of what the camera sees. Bits of a Gray
/// code change at different places.
std::optional<LightFault> find_same_bit(const CodeLight& light) {
  constexpr double kPart = 0.2;
  const auto in_part = [&](std::size_t k) { return light.share(k) > kPart && light.share(k) < 1 - kPart; };
  for (std::size_t k = 1; k < light.bits(); ++k)
    if (in_part(k - 1) && in_part(k) && light.change(k) < 2 * light.variance(k))
      return LightFault{
          fmt::format("photographs {} and {} are the same, and their patterns are not", k, k + 1),
          {{"a frame came late or twice", "empty the camera's queue before each pattern"}}};
  return std::nullopt;
}

}  // namespace

std::optional<Error> wrong_light_of(const CoarseCode& code, std::span<const Radiance> photographs,
                                    int channel) {
  constexpr std::int64_t kFewestPixels = 16;  // fewer tell nothing
  const CodeLight light(code, photographs, channel);
  if (light.pixels() < kFewestPixels) return std::nullopt;
  // A camera that has pixels of its own, and sees nothing, may be aimed elsewhere: that is for the screws.
  const bool aimed = photographs.front().mean.grid() == code.cells();
  if (const auto dark = find_dark(light)) return aimed ? std::optional(dark->error()) : std::nullopt;
  for (const auto find : {find_alike, find_black_brighter, find_automatic})
    if (const auto fault = find(light)) return fault->error();
  if (light.white() <= kLightSigmas * light.noise()) return std::nullopt;
  if (const auto fault = find_same_bit(light)) return fault->error();
  return std::nullopt;
}

std::optional<Error> wrong_turn_of(const Alignment& alignment) {
  if (!alignment.seen || alignment.own_pixels()) return std::nullopt;
  const double turn = std::abs(alignment.shape.turn);
  const bool mirrored = alignment.shape.mirrored, upright = turn < 45, quarter = !upright && turn < 135;
  if (upright && !mirrored) return std::nullopt;
  // A mirrored picture counts as mirrored left to right, and then turned.
  const Turn found = quarter    ? (mirrored ? Turn::transposed : Turn::quarter)
                     : mirrored ? (upright ? Turn::columns : Turn::rows)
                                : Turn::both;
  // A picture of pixels in another order looks turned and mirrored, by any angle.
  constexpr double kSquare = 20;
  const bool square = std::abs(std::remainder(turn, 90.0)) < kSquare;
  return LightFault{
      fmt::format("the stripes lie turned by {:.0f} degrees{}, and the camera has a pixel for each cell",
                  turn, mirrored ? " and mirrored" : ""),
      square ? std::vector{acquisition::cause_of_turn(found)} : acquisition::causes_of_other_pixels()}
      .error();
}

}  // namespace symrig::calibration
