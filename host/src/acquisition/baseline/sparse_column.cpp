// SPDX-License-Identifier: Apache-2.0
#include "acquisition/baseline/sparse_column.hpp"

#include <cmath>

namespace symrig::acquisition {

SparseColumn significant_column(const TreePhotograph& photograph, const PixelSet& seen, int channels) {
  const std::size_t pixels = photograph.pattern.size();
  const std::size_t samples = pixels * static_cast<std::size_t>(channels);
  SparseColumn out;
  for (const std::int32_t p : seen.pixels) {
    bool significant = false;
    for (auto at = static_cast<std::size_t>(p); at < samples; at += pixels)
      significant =
          significant || (photograph.valid[at] != 0 &&
                          std::abs(photograph.mean[at]) > kGateSigmas * std::sqrt(photograph.variance[at]));
    if (!significant) continue;
    out.pixels.push_back(p);
    for (auto at = static_cast<std::size_t>(p); at < samples; at += pixels)
      out.values.push_back(photograph.mean[at]);
  }
  return out;
}

}  // namespace symrig::acquisition
