// SPDX-License-Identifier: Apache-2.0
#include "rig/pairs/each_pair.hpp"
#include "symrig/rig/pairs.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

using Cameras = std::vector<std::unique_ptr<Camera>>;

class JoinedCamera final : public Camera {
 public:
  JoinedCamera(Cameras cameras, PairLayout layout) : cameras_(std::move(cameras)), layout_(layout) {}

  Grid grid() const override { return layout_.cells; }
  int channels() const override { return cameras_.front()->channels(); }
  /// What every camera keeps.
  CameraTiming timing() const override {
    CameraTiming all = cameras_.front()->timing();
    Nanoseconds gap{0};  // until each takes its next trigger
    for (const auto& one : cameras_) {
      const CameraTiming timing = one->timing();
      gap = std::max(gap, timing.readout - timing.overlap);
      all.min_exposure = std::max(all.min_exposure, timing.min_exposure);
      all.max_exposure = std::min(all.max_exposure, timing.max_exposure);
      all.readout = std::max(all.readout, timing.readout);
    }
    all.overlap = all.readout - gap;
    return all;
  }
  /// For planning. Each frame is read with the noise of its own camera.
  const NoiseModel& noise() const override { return cameras_.front()->noise(); }
  const Image<std::uint8_t>* dead() const override { return nullptr; }

  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override {
    std::vector<std::vector<CameraFrame>> taken(cameras_.size());
    SYMRIG_CHECK(rig::for_each_pair(cameras_.size(), [&](std::size_t k) -> Result<void> {
      SYMRIG_TRY(taken[k], cameras_[k]->take(count, patience));
      for (CameraFrame& frame : taken[k]) frame.camera = k;
      return {};
    }));
    std::vector<CameraFrame> all;
    for (auto& frames : taken) std::ranges::move(frames, std::back_inserter(all));
    return all;
  }

  std::size_t count() const override { return cameras_.size(); }
  const Camera& part(std::size_t index) const override { return *cameras_[index]; }
  std::string describe() const override {
    std::string text = fmt::format("{} cameras", cameras_.size());
    for (const auto& one : cameras_) text += (&one == cameras_.data() ? ": " : "; ") + one->describe();
    return text;
  }

 private:
  Cameras cameras_;
  PairLayout layout_;
};

}  // namespace

Result<std::unique_ptr<Camera>> join_cameras(Cameras cameras, const PairLayout& layout) {
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    if (cameras[k]->channels() != cameras.front()->channels())
      return Error{ErrorCode::bad_argument,
                   fmt::format("pair {}: its camera has {} channels, but that of pair 1 has {}", k + 1,
                               cameras[k]->channels(), cameras.front()->channels()),
                   "give all pairs cameras of one kind"};
    const Nanoseconds delay = cameras[k]->timing().trigger_delay, first = cameras[0]->timing().trigger_delay;
    if (delay != first)
      return Error{
          ErrorCode::bad_argument,
          fmt::format("pair {}: its camera exposes {} ns after the trigger, but that of pair 1 {} ns", k + 1,
                      delay.count(), first.count()),
          "set the delays of all cameras to the longest one: camera.features.TriggerDelay"};
  }
  return std::unique_ptr<Camera>(std::make_unique<JoinedCamera>(std::move(cameras), layout));
}

}  // namespace symrig
