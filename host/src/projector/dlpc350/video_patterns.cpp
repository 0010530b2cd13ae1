// SPDX-License-Identifier: Apache-2.0
#include "projector/dlpc350/video_patterns.hpp"

#include <utility>

#include <fmt/format.h>

namespace symrig::projector::dlpc350 {
namespace {

using dlp::Run;
using dlp::Status;

constexpr Grid kMirrors{1140, 912};
/// 24 bits at the parallel port (bits 7:3 of the source).
constexpr std::uint8_t kPort24Bits = 1U << 3U;
constexpr std::uint8_t kFromVideo = 0, kByVsync = 0;
/// TRIG_OUT_1 falls 20 us before the end of its plane: planes without a dark time between them have edges,
/// too.
constexpr std::uint8_t kEarliest = 0;

}  // namespace

VideoPatterns::VideoPatterns(Controller controller) : controller_(std::move(controller)) {
  name_ = controller_.name();
}

VideoPatterns::~VideoPatterns() {
  try {
    (void)end();
  } catch (...) {
    // Only a lack of memory throws, and then nothing more can be done.
  }
}

Result<std::unique_ptr<VideoPatterns>> VideoPatterns::begin(Controller controller,
                                                            const dlp::PictureSource& source,
                                                            const VideoPatternOptions& options) {
  std::unique_ptr<VideoPatterns> patterns(new VideoPatterns(std::move(controller)));
  SYMRIG_TRY(patterns->sequence_, dlp::sequence_of(options, source.refresh, kPlaneLimits));
  SYMRIG_TRY(patterns->version_, patterns->controller_.version());
  SYMRIG_CHECK(check_ready(patterns->controller_));
  SYMRIG_CHECK(dlp::await_signal([&] { return patterns->check_signal(source); }, options.lock_patience));
  SYMRIG_TRY(patterns->found_, read_state(patterns->controller_));
  SYMRIG_CHECK(patterns->write(options));
  SYMRIG_CHECK(patterns->read_back());
  SYMRIG_CHECK(patterns->start());
  return patterns;
}

Result<void> VideoPatterns::check_signal(const dlp::PictureSource& source) {
  SYMRIG_TRY(const dlp::Signal signal, controller_.signal());
  return dlp::check_signal(name_, signal, source, kMirrors);
}

Result<void> VideoPatterns::write(const VideoPatternOptions& options) {
  wanted_ = *found_;
  wanted_.source = static_cast<std::uint8_t>(static_cast<std::uint8_t>(options.port) | kPort24Bits);
  wanted_.pattern_source = kFromVideo;
  wanted_.trigger_mode = kByVsync;
  wanted_.inverted = false;
  wanted_.times = {sequence_.exposure_us, sequence_.period_us};
  wanted_.counts = {sequence_.planes, true, sequence_.planes, 1};
  wanted_.table = video_table(sequence_.planes, sequence_.leds);
  SYMRIG_TRY(const std::uint8_t plane_delay, delay_code(options.plane_delay));
  SYMRIG_TRY(const std::uint8_t frame_delay, delay_code(options.frame_delay));
  wanted_.plane_trigger = {options.plane_inverted, plane_delay, kEarliest};
  wanted_.frame_trigger = {options.frame_inverted, frame_delay};
  wanted_.led_enable = {sequence_.leds, true};
  if (options.led_currents) wanted_.led_currents = *options.led_currents;
  wanted_.shows_patterns = true;
  wanted_.run = Run::stop;
  return restore_state(controller_, wanted_);
}

Result<void> VideoPatterns::read_back() {
  SYMRIG_TRY(const SavedState now, read_state(controller_));
  if (now == wanted_) return {};
  const auto bad_entry = [&]() -> std::size_t {
    for (std::size_t k = 0; k < now.table.size() && k < wanted_.table.size(); ++k)
      if (now.table[k] != wanted_.table[k]) return k;
    return wanted_.table.size();
  }();
  const std::string what = bad_entry < wanted_.table.size()
                               ? fmt::format("plane {} of its pattern table", bad_entry)
                               : std::string("a setting");
  return Error{ErrorCode::device_refused, fmt::format("{} did not keep {}", name_, what),
               "close other programs that use the controller, and try again"};
}

Result<void> VideoPatterns::start() {
  SYMRIG_TRY(const Validation validation, controller_.validate());
  if (!validation.ok())
    return Error{ErrorCode::device_refused, name_ + " refuses the sequence: " + to_string(validation),
                 "give a longer period, or fewer planes"};
  SYMRIG_CHECK(controller_.set_run(Run::start));
  wanted_.run = Run::start;
  return {};
}

Result<void> VideoPatterns::check() {
  // The times come last: a reset changes them, so none that comes between these commands is missed.
  SYMRIG_TRY(const Status status, controller_.status());
  SYMRIG_TRY(const Run run, controller_.run());
  SYMRIG_TRY(const bool patterns, controller_.shows_patterns());
  SYMRIG_TRY(const Times times, controller_.times());
  if (run == Run::start && patterns && times == wanted_.times && !status.sequencer_error() &&
      !status.sequencer_aborted())
    return {};
  return Error{ErrorCode::device_lost,
               name_ + " no longer runs its sequence: it was reset, or another program changed it",
               "check its power supply, and close other programs that use it"};
}

Result<void> VideoPatterns::end() {
  if (!found_) return {};  // nothing was changed, or it is put back already
  const SavedState found = *std::exchange(found_, std::nullopt);
  return restore_state(controller_, found);
}

}  // namespace symrig::projector::dlpc350
