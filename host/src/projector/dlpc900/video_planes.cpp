// SPDX-License-Identifier: Apache-2.0

#include "projector/dlp/plane_source.hpp"
#include "symrig/projector/internal/dlp.hpp"
#include "symrig/projector/internal/dlpc900.hpp"
#include "symrig/projector/internal/driver.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <thread>
#include <utility>

#include <fmt/format.h>

namespace symrig::projector::dlpc900 {
namespace {

using dlp::Run;
using dlp::Steps;

/// In video mode there is no sequence, and the controller refuses to stop one. The mode is written in any
/// case: it reads wrong for a time after a change.
Result<void> stop_patterns(Controller& controller) {
  SYMRIG_TRY(const ControllerMode mode, controller.display_mode());
  if (mode != ControllerMode::video) SYMRIG_CHECK(controller.set_run(Run::stop));
  return controller.set_display_mode(ControllerMode::video);
}

}  // namespace

Result<SavedState> read_state(Controller& controller) {
  SavedState state;
  SYMRIG_TRY(state.mode, controller.display_mode());
  SYMRIG_TRY(state.source, controller.source());
  SYMRIG_TRY(state.receiver, controller.receiver());
  SYMRIG_TRY(state.frame_trigger, controller.trigger_out(1));
  SYMRIG_TRY(state.plane_trigger, controller.trigger_out(2));
  SYMRIG_TRY(state.led_enable, controller.led_enable());
  SYMRIG_TRY(state.led_currents, controller.led_currents());
  return state;
}

Result<void> write_settings(Controller& controller, const SavedState& state) {
  Steps steps;
  steps.take([&] { return stop_patterns(controller); });
  steps.take([&] { return controller.set_source(state.source); });
  steps.take([&] { return controller.set_receiver(state.receiver); });
  steps.take([&] { return controller.set_trigger_out(1, state.frame_trigger); });
  steps.take([&] { return controller.set_trigger_out(2, state.plane_trigger); });
  steps.take([&] { return controller.set_led_currents(state.led_currents); });
  steps.take([&] { return controller.set_led_enable(state.led_enable); });
  return std::move(steps).result();
}

Result<void> restore_state(Controller& controller, const SavedState& state) {
  Steps steps;
  steps.take([&] { return write_settings(controller, state); });
  steps.take([&] {
    return state.mode == ControllerMode::video ? Result<void>() : controller.set_display_mode(state.mode);
  });
  return std::move(steps).result();
}

namespace {

using dlp::Run;
using dlp::Status;

/// The parallel port with 24 bits (DLPU018J, appendix A: the value after a reset).
constexpr std::uint8_t kParallel24Bits = 1U << 3U;
/// TRIG_OUT_2 has pulses of this length, in microseconds: the least that the controller makes.
constexpr std::int16_t kPulse = 20;
/// How often a state that comes soon is asked for.
constexpr int kQuestions = 40;

/// Asks until the answer is yes. false: it never was.
template <class Question>
Result<bool> becomes(Nanoseconds patience, Question question) {
  for (int tries = 0; tries < kQuestions; ++tries) {
    SYMRIG_TRY(const bool yes, question());
    if (yes) return true;
    std::this_thread::sleep_for(patience / kQuestions);
  }
  return false;
}

std::string lost_table(const std::string& name, ControllerMode mode) {
  return fmt::format(
      "{} was in the mode '{}', and does not tell its pattern table: afterwards, send the table again with "
      "the "
      "program that made it",
      name, name_of(mode));
}

}  // namespace

VideoPlanes::VideoPlanes(Controller controller) : controller_(std::move(controller)) {
  name_ = controller_.name();
}

VideoPlanes::~VideoPlanes() {
  try {
    (void)end();
  } catch (...) {
    // Only a lack of memory throws, and then nothing more can be done.
  }
}

Result<std::unique_ptr<VideoPlanes>> VideoPlanes::begin(Controller controller,
                                                        const dlp::PictureSource& source,
                                                        const VideoPlaneOptions& options) {
  std::unique_ptr<VideoPlanes> planes(new VideoPlanes(std::move(controller)));
  SYMRIG_TRY(planes->sequence_, dlp::sequence_of(options, source.refresh, kPlaneLimits));
  SYMRIG_TRY(planes->version_, planes->controller_.version());
  SYMRIG_CHECK(check_ready(planes->controller_));
  SYMRIG_TRY(const std::uint8_t type, planes->controller_.mirrors());
  const auto mirrors = mirrors_of(type);
  if (!mirrors)
    return Error{ErrorCode::device_refused,
                 fmt::format("{} has mirrors of an unknown kind, {}", planes->name_, type),
                 "use a DLP6500, DLP9000, DLP670S, DLP500YX or DLP5500"};
  planes->mirrors_ = mirrors->grid;
  SYMRIG_TRY(planes->found_, read_state(planes->controller_));
  if (planes->found_->mode != ControllerMode::video)
    planes->warnings_.push_back(lost_table(planes->name_, planes->found_->mode));
  SYMRIG_CHECK(planes->write(options));
  SYMRIG_CHECK(planes->await_signal(source, options.lock_patience));
  SYMRIG_CHECK(planes->enter_pattern_mode(options));
  SYMRIG_CHECK(planes->write_table());
  SYMRIG_CHECK(planes->start(options.patience));
  return planes;
}

Result<void> VideoPlanes::write(const VideoPlaneOptions& options) {
  wanted_ = *found_;
  wanted_.mode = ControllerMode::video;
  wanted_.source = kParallel24Bits;
  if (options.port) wanted_.receiver = static_cast<std::uint8_t>(*options.port);
  SYMRIG_TRY(const std::int16_t plane_delay, delay_us(options.plane_delay));
  SYMRIG_TRY(const std::int16_t frame_delay, delay_us(options.frame_delay));
  wanted_.plane_trigger = {options.plane_inverted, plane_delay,
                           static_cast<std::int16_t>(plane_delay + kPulse)};
  wanted_.frame_trigger = {options.frame_inverted, frame_delay, std::max(frame_delay, std::int16_t{0})};
  wanted_.led_enable = {sequence_.leds, true};
  if (options.led_currents) wanted_.led_currents = *options.led_currents;
  return write_settings(controller_, wanted_);
}

Result<void> VideoPlanes::await_signal(const dlp::PictureSource& source, Nanoseconds patience) {
  const auto check = [&]() -> Result<void> {
    SYMRIG_TRY(const dlp::Signal signal, controller_.signal());
    return dlp::check_signal(name_, signal, source, mirrors_);
  };
  return dlp::await_signal(check, patience);
}

Result<void> VideoPlanes::enter_pattern_mode(const VideoPlaneOptions& options) {
  SYMRIG_CHECK(controller_.set_display_mode(ControllerMode::video_patterns));
  wanted_.mode = ControllerMode::video_patterns;
  std::this_thread::sleep_for(options.mode_time);
  SYMRIG_TRY(const bool entered, becomes(options.patience, [this]() -> Result<bool> {
               SYMRIG_TRY(const SavedState now, read_state(controller_));
               return now == wanted_;
             }));
  if (entered) return {};
  return Error{ErrorCode::device_refused,
               fmt::format("{} did not keep a setting, or did not enter video-pattern mode", name_),
               "close other programs that use the controller, and try again"};
}

/// The number of entries can be read, the entries cannot.
Result<void> VideoPlanes::write_table() {
  SYMRIG_CHECK(controller_.set_run(Run::stop));
  SYMRIG_CHECK(controller_.set_table(video_table(sequence_)));
  counts_ = {sequence_.planes, 0};
  SYMRIG_CHECK(controller_.set_counts(counts_));
  SYMRIG_TRY(const Counts now, controller_.counts());
  if (now == counts_) return {};
  return Error{ErrorCode::device_refused,
               fmt::format("{} did not keep its pattern table: it has {} entries instead of {}", name_,
                           now.entries, counts_.entries),
               "close other programs that use the controller, and try again"};
}

Result<void> VideoPlanes::start(Nanoseconds patience) {
  SYMRIG_CHECK(controller_.set_run(Run::start));
  SYMRIG_TRY(const bool running, becomes(patience, [this] { return runs(); }));
  if (running) return {};
  SYMRIG_TRY(const Status status, controller_.status());
  return Error{ErrorCode::device_refused,
               fmt::format("{} does not run the sequence (hardware status {:#04x}, main status {:#04x})",
                           name_, status.hardware, status.main),
               "give a shorter plane_period, or fewer planes"};
}

/// The flag of an abort stays after a stop (importly/dmdcontrol, dlpc_status.py), so only that of an error
/// counts.
Result<bool> VideoPlanes::runs() {
  SYMRIG_TRY(const Status status, controller_.status());
  return status.initialized() && !status.sequencer_error() && status.sequencing() && is_locked(status);
}

Result<void> VideoPlanes::check() {
  // The settings come last: a reset changes them, so none that comes between these commands is missed.
  SYMRIG_TRY(const bool running, runs());
  SYMRIG_TRY(const Counts counts, controller_.counts());
  SYMRIG_TRY(const SavedState now, read_state(controller_));
  if (running && counts == counts_ && now == wanted_) return {};
  return Error{
      ErrorCode::device_lost,
      fmt::format("{} no longer runs its sequence: it was reset, lost its signal, or another program "
                  "changed it",
                  name_),
      "check its power supply and its video cable, and close other programs that use it"};
}

Result<void> VideoPlanes::end() {
  if (!found_) return {};  // nothing was changed, or it is put back already
  const SavedState found = *std::exchange(found_, std::nullopt);
  return restore_state(controller_, found);
}

}  // namespace symrig::projector::dlpc900

namespace symrig::projector {
namespace {

constexpr std::string_view kDriverDlpc900 = "dlpc900";

// The keys of `[projector]`: docs/rig-file.md.
std::unique_ptr<ProjectorSource> read_dlpc900_projector(base::TableReader& table) {
  using Port = std::optional<dlpc900::Port>;
  dlp::PlaneKeys keys;
  keys.screen.mode = "1920x1080@60";
  dlpc900::VideoPlaneOptions sequence;
  dlp::read_plane_keys(table, keys, sequence);
  constexpr std::array<std::pair<std::string_view, Port>, 3> kPorts{
      {{"hdmi", dlpc900::Port::hdmi},
       {"displayport", dlpc900::Port::display_port},
       {"unchanged", std::nullopt}}};
  table.read_choice<Port>("port", sequence.port, kPorts);
  // Up to 100 us: later edges would leave a plane too short for an exposure.
  dlp::read_delay(table, "plane_delay_us", -19, 100, sequence.plane_delay);
  dlp::read_delay(table, "frame_delay_us", -20, 100, sequence.frame_delay);
  dlp::check_delays(table, sequence);
  using Source = dlp::PlaneSourceOf<dlpc900::VideoPlanes, dlpc900::Controller, dlpc900::VideoPlaneOptions>;
  return std::make_unique<Source>(dlp::kDlpc900, kDriverDlpc900, std::move(keys), sequence);
}

}  // namespace

ProjectorDriver dlpc900_driver() {
  return {kDriverDlpc900, "a DLPC900 that splits the pictures of a screen into bit planes", "",
          read_dlpc900_projector};
}

}  // namespace symrig::projector
