// SPDX-License-Identifier: Apache-2.0
#include "sim/texture.hpp"

#include "sim/hash.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace symrig::sim {

namespace {

struct Octave {
  float cells;  // lattice cells along the longer side
  float share;  // of the whole amplitude
};
constexpr std::array<Octave, 3> kOctaves{{{4.3F, 0.30F}, {10.7F, 0.22F}, {31.3F, 0.18F}}};
constexpr float kGrainShare = 0.30F;

float lattice(std::uint64_t key, std::int64_t row, std::int64_t col) {
  return unit_float(combine(combine(key, static_cast<std::uint64_t>(row)), static_cast<std::uint64_t>(col)));
}

/// Bilinear interpolation of random values on the integer lattice.
float value_noise(std::uint64_t key, float v, float u) {
  const float v0 = std::floor(v);
  const float u0 = std::floor(u);
  const auto row = static_cast<std::int64_t>(v0);
  const auto col = static_cast<std::int64_t>(u0);
  const float fv = v - v0;
  const float fu = u - u0;
  const float top = (1 - fu) * lattice(key, row, col) + fu * lattice(key, row, col + 1);
  const float low = (1 - fu) * lattice(key, row + 1, col) + fu * lattice(key, row + 1, col + 1);
  return (1 - fv) * top + fv * low;
}

float albedo_at(Grid grid, std::uint64_t key, int row, int col) {
  const auto longer = static_cast<float>(std::max(grid.rows, grid.cols));
  const float v = (static_cast<float>(row) + 0.5F) / longer;
  const float u = (static_cast<float>(col) + 0.5F) / longer;
  float sum = kGrainShare * lattice(combine(key, 100), row, col);
  for (std::size_t k = 0; k < kOctaves.size(); ++k)
    sum += kOctaves[k].share * value_noise(combine(key, k), v * kOctaves[k].cells, u * kOctaves[k].cells);
  const float contrast = std::clamp(1.8F * sum - 0.4F, 0.F, 1.F);  // sums of noise are mostly near one half
  return kDarkest + (kBrightest - kDarkest) * contrast;
}

}  // namespace

std::vector<float> texture(Grid grid, std::uint64_t key) {
  std::vector<float> albedo;
  albedo.reserve(grid.size());
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) albedo.push_back(albedo_at(grid, key, row, col));
  return albedo;
}

}  // namespace symrig::sim
