// SPDX-License-Identifier: Apache-2.0
#include "sim/image_formation.hpp"

#include "sim/camera_optics.hpp"
#include "sim/hash.hpp"
#include "sim/rig_profiles.hpp"
#include "symrig/projector/placement.hpp"

#include <cmath>
#include <utility>

namespace symrig::sim {

namespace {

/// The key of the camera's noise.
std::uint64_t noise_of(const SceneUri& uri) {
  const auto seed = static_cast<std::uint64_t>(uri.seed);
  return uri.noise_seed == 0 ? seed : combine(seed, static_cast<std::uint64_t>(uri.noise_seed));
}

}  // namespace

ImageFormation::ImageFormation(const SceneUri& uri, const View& view)
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
