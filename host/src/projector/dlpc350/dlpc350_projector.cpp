// SPDX-License-Identifier: Apache-2.0
#include "projector/dlpc350/dlpc350_projector.hpp"

#include "projector/bit_planes.hpp"

#include <utility>

#include <fmt/format.h>

namespace symrig::projector::dlpc350 {

Result<std::unique_ptr<Dlpc350Projector>> Dlpc350Projector::open(std::unique_ptr<DrmProjector> screen,
                                                                 Controller controller,
                                                                 const Dlpc350Options& options) {
  if (!screen->counts_refreshes())
    return Error{ErrorCode::device_refused,
                 "the screen does not count refreshes, so no picture can be tied to its bit planes",
                 "connect the controller to another graphics card"};
  const PictureSource source{screen->screen(), screen->refresh_period()};
  SYMRIG_TRY(auto sequence, VideoPatterns::begin(std::move(controller), source, options.sequence));
  return std::unique_ptr<Dlpc350Projector>(
      new Dlpc350Projector(std::move(screen), std::move(sequence), options));
}

Dlpc350Projector::Dlpc350Projector(std::unique_ptr<DrmProjector> screen,
                                   std::unique_ptr<VideoPatterns> sequence, const Dlpc350Options& options)
    : screen_(std::move(screen)),
      sequence_(std::move(sequence)),
      frame_lead_(options.sequence.plane_delay - options.sequence.frame_delay),
      latency_(options.latency) {
  for (int k = 0; k < sequence_->sequence().planes; ++k) bits_.push_back(bit_of_plane(k));
}

Result<void> Dlpc350Projector::load(std::span<const Pattern> patterns) {
  SYMRIG_TRY(auto pictures, spread_over_planes(patterns, grid(), bits_));
  return screen_->load_words(std::move(pictures));
}

PlaneTiming Dlpc350Projector::planes() const {
  const Sequence& sequence = sequence_->sequence();
  return {sequence.planes, Nanoseconds{1000 * std::int64_t{sequence.period_us}},
          Nanoseconds{1000 * std::int64_t{sequence.exposure_us}}, frame_lead_, latency_};
}

Result<void> Dlpc350Projector::load_planes(std::span<const Pattern> patterns,
                                           std::span<const PlanePlan> plans) {
  SYMRIG_TRY(auto pictures, pack_planes(patterns, plans, grid(), bits_));
  return screen_->load_words(std::move(pictures));
}

std::string Dlpc350Projector::describe() const {
  const Sequence& sequence = sequence_->sequence();
  return fmt::format("{} with firmware {}, {} planes of {} us, on {}", sequence_->name(),
                     to_string(sequence_->version()), sequence.planes, sequence.period_us,
                     screen_->describe());
}

}  // namespace symrig::projector::dlpc350
