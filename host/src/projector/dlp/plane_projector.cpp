// SPDX-License-Identifier: Apache-2.0
#include "projector/dlp/plane_projector.hpp"

#include "projector/bit_planes.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

namespace symrig::projector::dlp {

Result<std::unique_ptr<PlaneProjector>> PlaneProjector::open(std::unique_ptr<DrmProjector> screen,
                                                             const PlaneProjectorOptions& options,
                                                             const Begin& begin) {
  if (!screen->counts_refreshes())
    return Error{ErrorCode::device_refused,
                 "the screen does not count refreshes, so no picture can be tied to its bit planes",
                 "connect the controller to another graphics card"};
  SYMRIG_TRY(auto sequence, begin({screen->screen(), screen->refresh_period()}));
  return std::unique_ptr<PlaneProjector>(new PlaneProjector(std::move(screen), std::move(sequence), options));
}

PlaneProjector::PlaneProjector(std::unique_ptr<DrmProjector> screen, std::unique_ptr<PlaneSequence> sequence,
                               const PlaneProjectorOptions& options)
    : screen_(std::move(screen)),
      sequence_(std::move(sequence)),
      options_(options),
      bits_(options.order.bits(sequence_->sequence().planes)) {}

Result<void> PlaneProjector::load(std::span<const Pattern> patterns) {
  SYMRIG_TRY(auto pictures, spread_over_planes(patterns, grid(), bits_));
  return screen_->load_words(std::move(pictures));
}

PlaneTiming PlaneProjector::planes() const {
  const Sequence& sequence = sequence_->sequence();
  return {sequence.planes, Nanoseconds{1000 * std::int64_t{sequence.period_us}},
          Nanoseconds{1000 * std::int64_t{sequence.exposure_us}}, options_.frame_lead, options_.latency};
}

Result<void> PlaneProjector::load_planes(std::span<const Pattern> patterns,
                                         std::span<const PlanePlan> plans) {
  SYMRIG_TRY(auto pictures, pack_planes(patterns, plans, grid(), bits_));
  return screen_->load_words(std::move(pictures));
}

std::vector<std::string> PlaneProjector::warnings() const {
  std::vector<std::string> all = screen_->warnings();
  std::ranges::copy(sequence_->warnings(), std::back_inserter(all));
  return all;
}

std::string PlaneProjector::describe() const {
  const Sequence& sequence = sequence_->sequence();
  return fmt::format("{} with firmware {}, {} planes of {} us, on {}", sequence_->name(),
                     to_string(sequence_->version()), sequence.planes, sequence.period_us,
                     screen_->describe());
}

}  // namespace symrig::projector::dlp
