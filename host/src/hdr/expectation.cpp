// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/expectation.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace symrig {
namespace {

// Keeps the exponent and the first two bits of the mantissa of a positive float.
constexpr unsigned kShift = 21;
constexpr std::uint32_t kFirst = std::bit_cast<std::uint32_t>(0x1p-60F) >> kShift;

}  // namespace

std::size_t LightHistogram::bin_of(float radiance) {
  if (!(radiance >= 0x1p-60F)) return 0;
  return std::min<std::size_t>((std::bit_cast<std::uint32_t>(radiance) >> kShift) - kFirst + 1, kBins - 1);
}

double LightHistogram::upper_end(std::size_t bin) {
  if (bin == 0) return 0;
  return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bin + kFirst) << kShift));
}

void LightHistogram::add(const LightHistogram& other) {
  for (std::size_t bin = 0; bin < kBins; ++bin) counts_[bin] += other.counts_[bin];
}

double LightHistogram::pixels() const {
  double sum = 0;
  for (const double n : counts_) sum += n;
  return sum;
}

double LightHistogram::mean_square() const {
  double sum = 0, pixels = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const double middle = 0.92 * upper_end(bin);  // geometric middle of a quarter of an octave
    sum += counts_[bin] * middle * middle;
    pixels += counts_[bin];
  }
  return pixels > 0 ? sum / pixels : 0;
}

std::vector<ExpectedLight> LightHistogram::lights() const {
  std::vector<ExpectedLight> lights;
  for (std::size_t bin = 0; bin < kBins; ++bin)
    if (counts_[bin] > 0) lights.push_back({upper_end(bin), counts_[bin]});
  return lights;
}

}  // namespace symrig
