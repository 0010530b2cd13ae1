// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/frame_taker.hpp"

#include "rig/bracket_taker.hpp"
#include "rig/exposure_choice.hpp"
#include "rig/shutter_timing.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

using namespace std::chrono_literals;

Result<void> check_codes(const CameraFrame& frame, Grid grid) {
  if (frame.raw.empty())
    return Error{ErrorCode::bad_argument, "the camera gives light and no codes, so it has no noise",
                 "give a rig whose camera has noise: remove noise=off"};
  if (std::ssize(frame.raw) == grid.size()) return {};
  return Error{ErrorCode::bad_argument,
               fmt::format("the camera gives {} codes for {} pixels", frame.raw.size(), grid.size()),
               "give a camera with one code for each pixel: remove channels=3"};
}

}  // namespace

FrameTaker::FrameTaker(RigOptions options) : options_(std::move(options)) {}

FrameTaker::~FrameTaker() = default;

Result<std::unique_ptr<FrameTaker>> FrameTaker::open(RigParts parts) {
  std::unique_ptr<FrameTaker> frames(new FrameTaker(std::move(parts.options)));
  RigOptions& options = frames->options_;
  frames->taker_ =
      std::make_unique<BracketTaker>(std::make_unique<DeviceSet>(std::move(parts.devices), options), options);
  SYMRIG_CHECK(frames->taker_->open());
  rig::adopt_timing(options, frames->taker_->camera().timing());
  SYMRIG_TRY(frames->timing_, frames->taker_->timing());
  return frames;
}

Result<RawFrames> FrameTaker::take(const Pattern& pattern, const Exposures& exposures) {
  SYMRIG_TRY(auto taken, taker_->take({&pattern, 1}, {&exposures, 1}));
  for (const CameraFrame& frame : taken.front().frames) SYMRIG_CHECK(check_codes(frame, camera_grid()));
  return RawFrames{std::move(taken.front().frames), std::move(taken.front().exposures)};
}

Grid FrameTaker::grid() const {
  return taker_->projector().grid();
}

Grid FrameTaker::camera_grid() const {
  return taker_->camera().grid();
}

int FrameTaker::bits() const {
  return taker_->camera().noise().bits();
}

Nanoseconds FrameTaker::shortest() const {
  return shortest_exposure(options_, timing_);
}

Nanoseconds FrameTaker::longest() const {
  return possible(timing_.max_exposure);
}

Nanoseconds FrameTaker::possible(Nanoseconds exposure) const {
  const Nanoseconds least = shortest(), period = options_.setup.projector.light_period;
  const Nanoseconds unit = period.count() > 0 ? period : Nanoseconds(1us);
  exposure = std::clamp(exposure, least, std::max(least, timing_.max_exposure));
  return std::max(least, exposure - exposure % unit);
}

const RigTrouble& FrameTaker::trouble() const {
  return taker_->trouble();
}

std::int64_t FrameTaker::frames() const {
  return taker_->frames();
}

double FrameTaker::rig_seconds() const {
  return taker_->rig_seconds();
}

}  // namespace symrig
