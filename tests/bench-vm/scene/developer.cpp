// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/developer.hpp"

#include "symrig/base/time.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include <fmt/format.h>

namespace symrig::bench_vm {

namespace {

constexpr std::size_t kKnownLights = 4;  // a frame sees one or two pictures, and the next one is prepared
constexpr Nanoseconds kLookAgain{50'000'000};  // interval of checking for the end

}  // namespace

Developer::Developer(const sim::ImageFormation& formation, Stage& stage, SceneCamera& camera,
                     const CameraHabits& habits, TruthLog log)
    : formation_(formation),
      stage_(stage),
      camera_(camera),
      habits_(habits),
      log_(std::move(log)),
      delivery_(habits.faults, camera.delays_frames()) {}

Result<DeliveryTally> Developer::run() {
  while (!stage_.stopped()) {
    if (const auto newest = stage_.newest(); newest.pattern) light_of(newest);
    if (const auto exposure = stage_.next_exposure(habits_.readout, next_look()))
      SYMRIG_CHECK(develop(*exposure));
    for (const DeliveredFrame& frame : delivery_.take_due(steady_now())) SYMRIG_CHECK(hand_over(frame));
    SYMRIG_CHECK(move_cable());
  }
  tally_.faults += delivery_.dropped();
  SYMRIG_CHECK(log_.close(fmt::format(R"({{"frames_delivered":{},"faults":{},"largest_doubt":{}}})",
                                      tally_.delivered, tally_.faults, tally_.largest_doubt.count())));
  return tally_;
}

Nanoseconds Developer::next_look() const {
  const Nanoseconds soon = steady_now() + kLookAgain;
  return std::min(soon, delivery_.next_due().value_or(soon));
}

Result<void> Developer::move_cable() {
  const bool wanted = stage_.camera_is_in();
  if (wanted == plugged_) return {};
  plugged_ = wanted;
  return camera_.plug(wanted);
}

/// Makes the frame of this exposure: light by time, then noise by the frame's number. Makes none if the
/// camera is not set to follow the pulse.
Result<void> Developer::develop(const Exposure& exposure) {
  const auto lit = stage_.lit_during(exposure);
  log_.exposed(exposure, lit);
  SYMRIG_TRY(const SceneCamera::Settings settings, camera_.settings());
  if (!settings.follows_pulse) {
    ++tally_.not_taken;
    return {};
  }
  std::vector<sim::ImageFormation::Share> shares;
  shares.reserve(lit.size());
  for (const ScreenTimeline::Lit& part : lit) shares.push_back({light_of(part), part.share});
  const Nanoseconds open = exposure.end.time - exposure.begin.time;
  auto codes = formation_.expose(*formation_.during(shares), seconds(open),
                                 static_cast<std::uint64_t>(habits_.first_frame) + exposure.frame);
  tally_.largest_doubt = std::max(tally_.largest_doubt, exposure.begin.doubt + exposure.end.doubt);
  delivery_.add({exposure.frame, settings.stamps_begin ? exposure.begin.time : exposure.end.time,
                 exposure.end.time + habits_.readout,
                 std::make_shared<const std::vector<std::uint16_t>>(std::move(codes)), open});
  return {};
}

sim::ImageFormation::Light Developer::light_of(const ScreenTimeline::Lit& lit) {
  const auto found = std::ranges::find_if(known_, [&lit](const KnownLight& known) {
    return known.number == lit.number && known.pattern == lit.pattern;
  });
  if (found != known_.end()) return found->light;
  if (known_.size() == kKnownLights) known_.pop_front();
  known_.push_back({lit.number, lit.pattern, formation_.light_of(*lit.pattern, lit.number)});
  return known_.back().light;
}

Result<void> Developer::hand_over(const DeliveredFrame& frame) {
  SYMRIG_TRY(const auto taken, camera_.deliver(frame));
  log_.delivered(frame, taken);
  ++tally_.delivered;
  if (taken != CameraPort::Taken::yes) ++tally_.not_taken;
  if (frame.fault != FrameFault::none) ++tally_.faults;
  return {};
}

}  // namespace symrig::bench_vm
