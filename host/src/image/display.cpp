// SPDX-License-Identifier: Apache-2.0
// Pictures for viewing: the exposure and the tone curve.
#include "symrig/base/quantile.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
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

/// The tone curve as a table: code_of() of any value, without its power function. A film needs it for each
/// sample of each frame.
class ToneCurve {
 public:
  ToneCurve() {
    for (std::size_t code = 1; code < bounds_.size(); ++code) bounds_[code] = least_of(code);
    bounds_.back() = 2;  // no value reaches it
    for (std::size_t bin = 0; bin < kBins; ++bin) first_[bin] = code_of(static_cast<double>(bin) / kBins);
  }

  std::uint8_t operator()(double linear) const {
    if (!(linear > 0)) return 0;
    const double value = std::min(linear, 1.0);
    std::size_t code = first_[std::min(static_cast<std::size_t>(value * kBins), kBins - 1)];
    while (value >= bounds_[code + 1]) ++code;
    return static_cast<std::uint8_t>(code);
  }

 private:
  static constexpr std::size_t kBins = 4096;  // a bin has at most two codes

  /// The least number with this code. Numbers above 0 are ordered as their bits are.
  static double least_of(std::size_t code) {
    std::uint64_t below = 0, above = std::bit_cast<std::uint64_t>(1.0);
    while (above - below > 1) {
      const std::uint64_t middle = below + (above - below) / 2;
      (code_of(std::bit_cast<double>(middle)) >= code ? above : below) = middle;
    }
    return std::bit_cast<double>(above);
  }

  std::array<double, 257> bounds_{};  ///< [code]: the least number with it
  std::array<std::uint8_t, kBins> first_{};
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
  std::ranges::transform(image.values(), display.values().begin(),
                         [exposure](float v) { return curve(exposure * static_cast<double>(v)); });
  return display;
}

}  // namespace symrig
