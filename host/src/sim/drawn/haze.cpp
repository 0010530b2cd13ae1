// SPDX-License-Identifier: Apache-2.0
#include "sim/drawn/haze.hpp"

#include "sim/drawn/translucent.hpp"

namespace symrig::sim::drawn {

Haze::Haze(double share, std::uint64_t key, std::span<const float> albedo)
    : share_(static_cast<float>(share / kSpeckles / static_cast<double>(albedo.size()))),
      pictures_(speckle_pictures(key, albedo.size(), kSpeckles)) {
  for (std::vector<float>& picture : pictures_)
    for (std::size_t i = 0; i < picture.size(); ++i) picture[i] *= albedo[i];
}

void Haze::add(float weight, std::span<const float> x, std::span<float> y) const {
  for (const std::vector<float>& picture : pictures_) {
    double sum = 0;
    for (std::size_t i = 0; i < picture.size(); ++i) sum += static_cast<double>(picture[i] * x[i]);
    const float light = weight * share_ * static_cast<float>(sum);
    for (std::size_t i = 0; i < picture.size(); ++i) y[i] += light * picture[i];
  }
}

}  // namespace symrig::sim::drawn
