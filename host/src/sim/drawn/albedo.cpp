// SPDX-License-Identifier: Apache-2.0
#include "sim/drawn/albedo.hpp"

#include "sim/hash.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::sim::drawn {

namespace {

float random_at(std::uint64_t key, std::int64_t row, std::int64_t col) {
  return unit_float(combine(combine(key, static_cast<std::uint64_t>(row)), static_cast<std::uint64_t>(col)));
}

/// Random numbers at whole v and u, and bilinear between them.
float bumps(std::uint64_t key, float v, float u) {
  const float v0 = std::floor(v), u0 = std::floor(u), fv = v - v0, fu = u - u0;
  const auto row = static_cast<std::int64_t>(v0), col = static_cast<std::int64_t>(u0);
  const float top = (1 - fu) * random_at(key, row, col) + fu * random_at(key, row, col + 1);
  const float low = (1 - fu) * random_at(key, row + 1, col) + fu * random_at(key, row + 1, col + 1);
  return (1 - fv) * top + fv * low;
}

/// Sums of random numbers are mostly near one half: more contrast.
float stretched(float value, float contrast) {
  return std::clamp(0.5F + contrast * (value - 0.5F), 0.F, 1.F);
}

/// Octaves of bumps, from two along the longer side to bumps of two points.
float fractal(std::uint64_t key, float v, float u, float longer) {
  float sum = 0;
  int octaves = 0;
  for (float cells = 2.3F; cells < longer || octaves == 0; cells *= 2, ++octaves)
    sum += bumps(combine(key, static_cast<std::uint64_t>(octaves)), v * cells, u * cells);
  const auto count = static_cast<float>(octaves);
  return stretched(sum / count, 1.3F * std::sqrt(count));
}

/// The number of the nearest of the seeds, one in each cell of a lattice.
float patches(std::uint64_t key, float v, float u) {
  const auto row = static_cast<std::int64_t>(std::floor(v)), col = static_cast<std::int64_t>(std::floor(u));
  float nearest = 1e9F, value = 0;
  for (std::int64_t r = row - 1; r <= row + 1; ++r)
    for (std::int64_t c = col - 1; c <= col + 1; ++c) {
      const float dv = static_cast<float>(r) + random_at(combine(key, 1), r, c) - v;
      const float du = static_cast<float>(c) + random_at(combine(key, 2), r, c) - u;
      const float distance = dv * dv + du * du;
      if (distance >= nearest) continue;
      nearest = distance;
      value = random_at(combine(key, 3), r, c);
    }
  return value;
}

}  // namespace

float Texture::at(Grid grid, int row, int col) const {
  const auto longer = static_cast<float>(std::max(grid.rows, grid.cols));
  const float v = (static_cast<float>(row) + 0.5F) / longer, u = (static_cast<float>(col) + 0.5F) / longer;
  const auto scale = static_cast<float>(cells);
  switch (spectrum) {
    case Spectrum::coarse:
      return stretched(bumps(key, v * scale, u * scale), 1.3F);
    case Spectrum::fractal:
      return fractal(key, v, u, longer);
    case Spectrum::patches:
      return patches(key, v * scale, u * scale);
    case Spectrum::grain:
      return random_at(key, row, col);
    case Spectrum::white:
      break;
  }
  return 1;
}

}  // namespace symrig::sim::drawn
