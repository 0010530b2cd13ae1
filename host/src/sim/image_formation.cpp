// SPDX-License-Identifier: Apache-2.0

#include "sim/image_formation.hpp"

#include "sim/light/random.hpp"
#include "sim/rig_profiles.hpp"
#include "symrig/projector/projector.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace symrig::sim {

namespace {

constexpr double kFlareLength = 0.1;  // of the longer side

/// out(i) = (1 − share) in(i + whole) + share in(i + whole + 1) along a line of n samples `stride` apart.
void shift_line(std::span<float> plane, std::size_t first, std::size_t stride, int n, double pixels,
                std::vector<float>& line) {
  const int whole = static_cast<int>(std::floor(pixels));
  const auto share = static_cast<float>(pixels - whole);
  const auto at = [&](int i) {
    return i < 0 || i >= n ? 0.F : plane[first + static_cast<std::size_t>(i) * stride];
  };
  for (int i = 0; i < n; ++i) line[i] = (1 - share) * at(i + whole) + share * at(i + whole + 1);
  for (int i = 0; i < n; ++i) plane[first + static_cast<std::size_t>(i) * stride] = line[i];
}

/// value(i) ← keep · value(i − 1) + (1 − keep) value(i), along both axes.
void trail(Grid grid, float keep, std::span<float> plane) {
  const std::size_t rows = grid.rows;
  const std::size_t cols = grid.cols;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t col = 0; col < cols; ++col) {
      float& here = plane[row * cols + col];
      here = (1 - keep) * here + (col > 0 ? keep * plane[row * cols + col - 1] : 0.F);
    }
  }
  for (std::size_t i = 0; i < rows * cols; ++i)
    plane[i] = (1 - keep) * plane[i] + (i >= cols ? keep * plane[i - cols] : 0.F);
}

}  // namespace

void shift(Grid grid, double pixels, std::span<float> plane) {
  const std::size_t rows = grid.rows;
  const std::size_t cols = grid.cols;
  std::vector<float> line(std::max(rows, cols));
  for (std::size_t row = 0; row < rows; ++row) shift_line(plane, row * cols, 1, grid.cols, pixels, line);
  for (std::size_t col = 0; col < cols; ++col) shift_line(plane, col, cols, grid.rows, pixels, line);
}

void add_flare(Grid grid, double share, std::span<float> plane) {
  std::vector<float> flare(plane.begin(), plane.end());
  trail(grid, static_cast<float>(std::exp(-1 / (kFlareLength * std::max(grid.rows, grid.cols)))), flare);
  for (std::size_t i = 0; i < flare.size(); ++i)
    plane[i] = static_cast<float>(1 - share) * plane[i] + static_cast<float>(share) * flare[i];
}

Image<std::uint8_t> dead_pixels(Grid grid, double share, std::uint64_t key) {
  if (share <= 0) return {};
  Image<std::uint8_t> dead(grid);
  for (std::size_t i = 0; i < dead.values().size(); ++i)
    dead.values()[i] = unit_double(combine(key, i)) < share ? 1 : 0;
  return dead;
}

namespace {

/// Maps 32 bits to the middle of one of 2³² equal cells of (0, 1).
double open_unit(std::uint32_t bits) {
  return (static_cast<double>(bits) + 0.5) * 0x1p-32;
}

std::uint16_t code_of(const NoiseModel& noise, double electrons, double z) {
  const double held = std::min(electrons, noise.full_well());
  const double code = noise.pedestal() + noise.gain() * (held + noise.read_noise() * z);
  return static_cast<std::uint16_t>(
      std::clamp(std::floor(code + 0.5), 0.0, static_cast<double>(noise.max_code())));
}

}  // namespace

void Sensor::expose(std::span<const float> radiance, double seconds, std::uint64_t frame,
                    std::span<std::uint16_t> codes, std::uint64_t first) const {
  const std::uint64_t key = combine(combine(0x5e4504, seed), frame);
  for (std::size_t i = 0; i < radiance.size(); ++i) {
    const std::uint64_t bits = combine(key, first + i);
    const double mean = sensitivity * seconds * static_cast<double>(radiance[i]);
    const auto electrons = poisson_quantile(mean, open_unit(static_cast<std::uint32_t>(bits >> 32U)));
    const double z = normal_quantile(open_unit(static_cast<std::uint32_t>(bits)));
    codes[i] = code_of(noise, static_cast<double>(electrons), z);
  }
}

namespace {

/// The key of the camera's noise.
std::uint64_t noise_of(const SceneUri& uri) {
  const auto seed = static_cast<std::uint64_t>(uri.seed);
  return uri.noise_seed == 0 ? seed : combine(seed, static_cast<std::uint64_t>(uri.noise_seed));
}

}  // namespace

ImageFormation::ImageFormation(const SceneUri& uri, const CameraView& view)
    : view_(view),
      cells_(uri.size),
      gamma_(uri.gamma),
      black_(static_cast<float>(uri.black)),
      misalign_(is_bench(uri) ? 0 : uri.misalign),
      flare_(uri.flare),
      drift_(uri.drift),
      sensor_{NoiseModel::from_electrons({}), kSensitivity * transmission_of(uri), noise_of(uri)} {
  if (uri.black > 0 && !view.moves()) leak_ = view.see(Image<float>(cells_, 1, black_), 0);
}

/// The light of a pattern from a projector whose light is a power of its level.
Image<float> ImageFormation::projected(const Image<float>& pattern) const {
  const CodeTable codes;
  Image<float> light = pattern;
  for (float& value : light.values()) value = static_cast<float>(std::pow(codes.code(value) / 255.0, gamma_));
  return light;
}

ImageFormation::Light ImageFormation::light_of(const Image<float>& pattern,
                                               std::uint64_t shown_before) const {
  Image<float> sent = gamma_ == 1 ? pattern : projected(pattern);
  if (view_.moves())
    for (float& value : sent.values()) value += black_;
  Image<float> light = view_.see(sent, shown_before);
  for (std::size_t i = 0; i < leak_.values().size(); ++i) light.values()[i] += leak_.values()[i];
  for (int c = 0; c < light.channels(); ++c) {
    if (misalign_ != 0) shift(light.grid(), misalign_, light.plane(c));
    if (flare_ > 0) add_flare(light.grid(), flare_, light.plane(c));
  }
  const auto lamp = static_cast<float>(1 + drift_ * static_cast<double>(shown_before) / 1000);
  if (drift_ != 0)
    for (float& value : light.values()) value *= lamp;
  return std::make_shared<const Image<float>>(std::move(light));
}

ImageFormation::Light ImageFormation::during(std::span<const Share> shares) const {
  if (shares.size() == 1 && shares[0].share == 1) return shares[0].light;
  Image<float> sum(view_.camera(), view_.channels());
  for (const Share& part : shares)
    for (std::size_t i = 0; i < sum.values().size(); ++i)
      sum.values()[i] += static_cast<float>(part.share) * part.light->values()[i];
  return std::make_shared<const Image<float>>(std::move(sum));
}

std::vector<std::uint16_t> ImageFormation::expose(const Image<float>& light, double seconds,
                                                  std::uint64_t frame, const Tile& tile) const {
  const auto row_size = static_cast<std::size_t>(tile.grid.cols);
  std::vector<std::uint16_t> codes(static_cast<std::size_t>(tile.grid.size()) * light.channels());
  std::span<std::uint16_t> left = codes;
  if (tile.grid == light.grid()) {
    sensor_.expose(light.values(), seconds, frame, left);
    return codes;
  }
  for (int c = 0; c < light.channels(); ++c)
    for (int row = 0; row < tile.grid.rows; ++row) {
      const std::size_t first = static_cast<std::size_t>(c) * light.grid().size() +
                                static_cast<std::size_t>(tile.row + row) * light.grid().cols +
                                static_cast<std::size_t>(tile.col);
      sensor_.expose(light.values().subspan(first, row_size), seconds, frame, left.first(row_size), first);
      left = left.subspan(row_size);
    }
  return codes;
}

}  // namespace symrig::sim
