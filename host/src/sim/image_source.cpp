// SPDX-License-Identifier: Apache-2.0
#include "sim/image_source.hpp"

#include "symrig/rig/pairs.hpp"

#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::sim {

LocalImages::LocalImages(const SceneUri& uri, const View& view, const Tile& tile)
    : noisy_(uri.camera_noise), formation_(uri, view), camera_(view.camera()), tile_(tile) {}

CameraFrame LocalImages::frame(const LitExposure& exposure,
                               std::span<const ImageFormation::Light> lights) const {
  std::vector<ImageFormation::Share> shares;
  shares.reserve(exposure.shares.size());
  for (const LitExposure::Share& one : exposure.shares) shares.push_back({lights[one.pattern], one.share});
  const ImageFormation::Light light = formation_.during(shares);
  const bool whole = tile_.grid == camera_;
  CameraFrame frame;
  if (!noisy_) {
    frame.attachment =
        whole ? light : ImageFormation::Light(std::make_shared<const Image<float>>(cut(*light, tile_)));
    return frame;
  }
  frame.raw = formation_.expose(*light, exposure.seconds, exposure.noise, tile_);
  return frame;
}

Result<std::vector<CameraFrame>> LocalImages::develop(std::span<const LitPattern> patterns,
                                                      std::span<const LitExposure> exposures) {
  std::vector<ImageFormation::Light> lights(patterns.size());
  tbb::parallel_for(std::size_t{0}, patterns.size(), [&](std::size_t i) {
    lights[i] = formation_.light_of(*patterns[i].pattern, patterns[i].shown_before);
  });
  std::vector<CameraFrame> frames(exposures.size());
  tbb::parallel_for(std::size_t{0}, frames.size(),
                    [&](std::size_t i) { frames[i] = frame(exposures[i], lights); });
  return frames;
}

}  // namespace symrig::sim
