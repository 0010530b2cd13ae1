// SPDX-License-Identifier: Apache-2.0

#include "sim/image_source.hpp"

#include "sim/light/random.hpp"
#include "symrig/base/time.hpp"
#include "symrig/rig/pairs.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::sim {

LocalImages::LocalImages(const SceneUri& uri, const CameraView& view, const Tile& tile)
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

namespace {

/// The patterns that an exposure saw, by their index in the projector's sequence.
using Seen = std::vector<SimulatedProjector::Lit>;

std::vector<std::size_t> indices_of(std::span<const Seen> seen) {
  std::vector<std::size_t> indices;
  for (const Seen& one : seen)
    for (const auto& lit : one) indices.push_back(lit.index);
  std::sort(indices.begin(), indices.end());
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
  return indices;
}

}  // namespace

/// Keys for the noise of frames. Usually the key is the frame's number. With planned exposures, a continued
/// capture does not know this number. Then the key combines the pattern's place and the frame's index among
/// the frames of that pattern. They may be developed one by one.
std::vector<std::uint64_t> FrameMaker::noise_keys(std::span<const SimulatedExposure> exposures) {
  std::vector<std::uint64_t> keys;
  std::map<std::pair<bool, std::uint64_t>, std::uint64_t> frames;  // of each place so far
  if (last_) frames[{last_->dark, last_->number}] = frames_of_last_;
  for (const SimulatedExposure& exposure : exposures) {
    const auto shown = projector_.shown(exposure.begin, exposure.end);
    if (!planned_ || shown.empty()) {
      keys.push_back(exposure.sequence);
      continue;
    }
    // Planes of one picture take turns, so the frames of a pattern need not follow each other.
    const auto place = projector_.place(shown.front().index);
    std::uint64_t& count = frames[{place.dark, place.number}];
    keys.push_back(combine(combine(place.dark ? 0xdaUL : 0x11UL, place.number), count++));
    last_ = place;
    frames_of_last_ = count;
  }
  return keys;
}

Result<std::vector<CameraFrame>> FrameMaker::develop(std::span<const SimulatedExposure> exposures) {
  const Stopwatch watch;
  std::vector<Seen> seen;
  seen.reserve(exposures.size());
  for (const SimulatedExposure& exposure : exposures)
    seen.push_back(projector_.shown(exposure.begin, exposure.end));
  const std::vector<std::size_t> indices = indices_of(seen);
  std::vector<LitPattern> patterns;
  patterns.reserve(indices.size());
  for (const std::size_t i : indices)
    patterns.push_back(
        {&projector_.pattern(i), planned_ ? projector_.place(i).number : projector_.loaded_before() + i});
  const std::vector<std::uint64_t> keys = noise_keys(exposures);
  std::vector<LitExposure> lit(exposures.size());
  for (std::size_t k = 0; k < lit.size(); ++k) {
    lit[k].seconds = static_cast<double>(exposures[k].end - exposures[k].begin) * tick_seconds_;
    lit[k].noise = keys[k];
    for (const auto& one : seen[k]) {
      const auto at = std::lower_bound(indices.begin(), indices.end(), one.index) - indices.begin();
      lit[k].shares.push_back({static_cast<std::uint32_t>(at), one.share});
    }
  }
  SYMRIG_TRY(auto frames, images_->develop(patterns, lit));
  for (std::size_t k = 0; k < frames.size(); ++k) frames[k].sequence = exposures[k].sequence;
  seconds_ += watch.seconds();
  return frames;
}

}  // namespace symrig::sim
