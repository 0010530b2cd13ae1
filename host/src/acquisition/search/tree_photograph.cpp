// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/tree_photograph.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace symrig::acquisition {
namespace {

/// Samples of one channel in tree order. No branches: this runs over every sample of every photograph.
struct Samples {
  std::span<float> mean, variance;
  std::span<std::uint8_t> valid;

  bool finite() const {
    constexpr std::uint32_t kMagnitude = 0x7FFF'FFFF, kInfinity = 0x7F80'0000;
    std::uint32_t wrong = 0;
    for (std::size_t t = 0; t < mean.size(); ++t) {
      const auto m = std::bit_cast<std::uint32_t>(mean[t]);
      const auto v = std::bit_cast<std::uint32_t>(variance[t] + 0.0F);  // −0 is 0
      // The top bit of |x| − ∞ is set below infinity, clear from there on and for NaN; of v − ∞ it is clear
      // for negative numbers too.
      wrong |= ~((m & kMagnitude) - kInfinity) | ~((v & kMagnitude) - kInfinity) | ~(v - kInfinity);
    }
    return wrong >> 31 == 0;
  }
  void clear_invalid() const {
    for (std::size_t t = 0; t < mean.size(); ++t) {
      mean[t] = valid[t] != 0 ? mean[t] : 0;
      variance[t] = valid[t] != 0 ? variance[t] : 0;
    }
  }
};

}  // namespace

bool to_tree(const BlockTree& tree, const Radiance& from, TreePhotograph& to) {
  const std::size_t pixels = tree.order().size();
  const std::size_t channels = from.mean.channels();
  to.mean.resize(channels * pixels);
  to.variance.resize(channels * pixels);
  to.valid.resize(channels * pixels);
  bool finite = true;
  for (std::size_t channel = 0; channel < channels; ++channel) {
    const auto plane = static_cast<int>(channel);
    const Samples samples{std::span(to.mean).subspan(channel * pixels, pixels),
                          std::span(to.variance).subspan(channel * pixels, pixels),
                          std::span(to.valid).subspan(channel * pixels, pixels)};
    tree.to_tree(from.mean.plane(plane), samples.mean);
    tree.to_tree(from.variance.plane(plane), samples.variance);
    const auto valid = from.valid.plane(plane);
    if (std::memchr(valid.data(), 0, valid.size()) == nullptr) {
      std::fill(samples.valid.begin(), samples.valid.end(), std::uint8_t{1});
    } else {
      for (std::size_t t = 0; t < pixels; ++t) samples.valid[t] = valid[tree.order()[t]] != 0 ? 1 : 0;
      samples.clear_invalid();
    }
    finite = samples.finite() && finite;
  }
  return finite;
}

}  // namespace symrig::acquisition
