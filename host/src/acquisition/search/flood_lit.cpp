// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/flood_lit.hpp"

#include <algorithm>
#include <utility>

namespace symrig::acquisition {

Result<FloodLit> FloodLit::read(const Photographer& photographer, int channels) {
  TreePhotograph photograph;
  SYMRIG_CHECK(photographer.read(
      0, 1, [&](std::int64_t, std::span<TreePhotograph> p) { photograph = std::move(p[0]); }));
  const std::size_t pixels = photograph.pattern.size();
  FloodLit flood;
  for (std::size_t channel = 0; channel < static_cast<std::size_t>(channels); ++channel) {
    double squares = 0;
    PairNoise noise;
    for (std::size_t t = channel * pixels; t < (channel + 1) * pixels; ++t) {
      if (photograph.valid[t] == 0) continue;
      squares += static_cast<double>(photograph.mean[t]) * static_cast<double>(photograph.mean[t]);
      noise.variance += photograph.variance[t];
      flood.noisy = flood.noisy || photograph.variance[t] > 0;
      ++noise.valid;
    }
    flood.noise.push_back(noise);
    flood.squared.push_back(noise.valid > 0 ? squares / noise.valid : 0);
  }
  if (std::all_of(flood.noise.begin(), flood.noise.end(), [](const PairNoise& n) { return n.valid == 0; }))
    return Error{ErrorCode::bad_value, "every pixel of the flood-lit photograph is invalid",
                 "shorten the exposures or look for a cap on the lens"};
  flood.image = std::move(photograph.mean);
  return flood;
}

}  // namespace symrig::acquisition
