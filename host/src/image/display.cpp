// SPDX-License-Identifier: Apache-2.0
// Pictures for viewing: the exposure and the tone curve.
#include "symrig/base/statistics.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace symrig {
namespace {

/// sRGB transfer function, IEC 61966-2-1: linear [0,1] → [0,1].
double srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

std::uint8_t code_of(double linear) {
  return static_cast<std::uint8_t>(std::lround(255 * srgb(std::clamp(linear, 0.0, 1.0))));
}

/// The tone curve by the numbers at which its codes begin. So a code is found without a power function.
class ToneCurve {
 public:
  ToneCurve() {
    for (std::size_t code = 1; code < bounds_.size(); ++code) bounds_[code] = least_of(code);
  }

  /// The least number with a code, 1 to 255.
  double bound(std::size_t code) const { return bounds_[code]; }

  std::uint8_t operator()(double linear) const {
    if (!(linear > 0)) return 0;
    return static_cast<std::uint8_t>(std::upper_bound(bounds_.begin() + 1, bounds_.end(), linear) -
                                     bounds_.begin() - 1);
  }

 private:
  /// Numbers above 0 are ordered as their bits are.
  static double least_of(std::size_t code) {
    std::uint64_t below = 0, above = std::bit_cast<std::uint64_t>(1.0);
    while (above - below > 1) {
      const std::uint64_t middle = below + (above - below) / 2;
      (code_of(std::bit_cast<double>(middle)) >= code ? above : below) = middle;
    }
    return std::bit_cast<double>(above);
  }

  std::array<double, 256> bounds_{};
};

/// The codes of floats at one exposure, by a table of their leading bits: a film needs them for each sample
/// of each frame. The same codes as the tone curve of exposure · value.
class ExposedCurve {
 public:
  /// None: the exposure is not positive and finite, or so extreme that a bin has more than two codes.
  static std::optional<ExposedCurve> make(const ToneCurve& curve, double exposure) {
    if (!(exposure > 0) || !std::isfinite(exposure)) return {};
    // [256]: no number is as large.
    std::array<float, kCodes + 1> bounds{};
    bounds.back() = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t code = 1; code < kCodes; ++code) bounds[code] = least_float(curve.bound(code), exposure);
    if (!std::isfinite(bounds[kCodes - 1])) return {};

    // One bin before the first bound, so that it and all smaller numbers have code 0.
    ExposedCurve exposed;
    exposed.base_ = std::max(bin_of(bounds[1]) - 1, 0);
    const std::int32_t bins = bin_of(bounds[kCodes - 1]) - exposed.base_ + 1;
    exposed.first_.resize(bins);
    exposed.bound_.resize(bins);
    std::size_t code = 0;
    for (std::int32_t bin = 0; bin < bins; ++bin) {
      while (bounds[code + 1] <= start_of(exposed.base_ + bin)) ++code;
      exposed.first_[bin] = static_cast<std::uint8_t>(code);
      exposed.bound_[bin] = bounds[code + 1];
      if (code + 2 < kCodes && bounds[code + 2] < start_of(exposed.base_ + bin + 1)) return {};
    }
    return exposed;
  }

  std::uint8_t operator()(float value) const {
    const float v = value > 0 ? value : 0.0F;  // NaN too
    const auto last = static_cast<std::int32_t>(first_.size()) - 1;
    const std::int32_t bin = std::clamp(bin_of(v) - base_, 0, last);
    return static_cast<std::uint8_t>(first_[bin] + (v >= bound_[bin] ? 1 : 0));
  }

 private:
  static constexpr std::size_t kCodes = 256;
  static constexpr int kShift = 15;  ///< 256 bins an octave: the curve has at most 57 codes in one

  static std::int32_t bin_of(float value) { return std::bit_cast<std::int32_t>(value) >> kShift; }
  static float start_of(std::int32_t bin) { return std::bit_cast<float>(bin << kShift); }

  /// The least float whose product with the exposure reaches a bound; infinity if none does.
  static float least_float(double bound, double exposure) {
    constexpr float kMost = std::numeric_limits<float>::max();
    const auto reaches = [&](float v) { return exposure * static_cast<double>(v) >= bound; };
    auto v = static_cast<float>(std::min(bound / exposure, static_cast<double>(kMost)));
    while (reaches(v)) v = std::nextafter(v, 0.0F);
    while (!reaches(v)) v = std::nextafter(v, std::numeric_limits<float>::infinity());
    return v;
  }

  std::int32_t base_ = 0;            ///< the bin of first_[0]
  std::vector<std::uint8_t> first_;  ///< the code of the least number of a bin
  std::vector<float> bound_;         ///< where the next code begins
};

}  // namespace

double automatic_exposure(const Image<float>& picture) {
  std::vector<float> values(picture.values().begin(), picture.values().end());
  const float white = quantile(values, 0.995);
  return white > 0 ? 1.0 / static_cast<double>(white) : 1.0;
}

Image<std::uint8_t> to_display(const Image<float>& image, double exposure) {
  static const ToneCurve curve;
  Image<std::uint8_t> display(image.grid(), image.channels());
  if (const auto exposed = ExposedCurve::make(curve, exposure))
    std::ranges::transform(image.values(), display.values().begin(), *exposed);
  else
    std::ranges::transform(image.values(), display.values().begin(),
                           [exposure](float v) { return curve(exposure * static_cast<double>(v)); });
  return display;
}

}  // namespace symrig
