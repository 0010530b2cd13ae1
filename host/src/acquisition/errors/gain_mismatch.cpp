// SPDX-License-Identifier: Apache-2.0
#include "acquisition/errors/gain_mismatch.hpp"

#include <cstdint>
#include <numeric>

namespace symrig::acquisition {
namespace {

/// ε of each pixel, in tree order.
std::vector<double> gain_of(const BlockTree& tree, const GainShapes& weights) {
  const std::vector<GainShapes> shapes = gain_shapes(tree.grid());
  std::vector<double> gain;
  gain.reserve(shapes.size());
  for (const std::int32_t raster : tree.order()) {
    const GainShapes& shape = shapes[static_cast<std::size_t>(raster)];
    gain.push_back(std::inner_product(shape.begin(), shape.end(), weights.begin(), 0.0));
  }
  return gain;
}

std::vector<float> applied(const TransportTensor& tensor, std::span<const float> pattern, int channel) {
  std::vector<float> seen(pattern.size());
  tensor.apply_tree(pattern, seen, channel, false);
  return seen;
}

std::vector<float> times(std::span<const float> pattern, std::span<const double> factor) {
  std::vector<float> product(pattern.size());
  for (std::size_t t = 0; t < pattern.size(); ++t)
    product[t] = static_cast<float>(static_cast<double>(pattern[t]) * factor[t]);
  return product;
}

}  // namespace

GainError::GainError(const TransportTensor& tensor, std::span<const TreePhotograph* const> photographs,
                     const GainMismatch& mismatch) {
  if (!mismatch.found) return;
  doubt_ = 2 * mismatch.sigma / mismatch.rms;
  const std::vector<double> gain = gain_of(tensor.camera_tree(), mismatch.shape);
  for (const TreePhotograph* const one : photographs) {
    Seen& seen = seen_.emplace_back();
    for (int channel = 0; channel < tensor.channels(); ++channel) {
      const auto here = times(applied(tensor, one->pattern, channel), gain);
      const auto there = applied(tensor, times(one->pattern, gain), channel);
      seen.here.append(here.begin(), here.end());
      seen.there.append(there.begin(), there.end());
    }
  }
}

GainLight GainError::light(std::span<const WeightedCheck> sum, std::size_t at) const {
  GainLight light;
  if (seen_.empty()) return light;
  for (const WeightedCheck& one : sum) {
    light.here += one.weight * static_cast<double>(seen_[one.photograph].here[at]);
    light.there += one.weight * static_cast<double>(seen_[one.photograph].there[at]);
  }
  return light;
}

}  // namespace symrig::acquisition
