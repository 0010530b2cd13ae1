// SPDX-License-Identifier: Apache-2.0

#include "projector/dlp/plane_source.hpp"
#include "symrig/projector/internal/dlp.hpp"
#include "symrig/projector/internal/dlpc350.hpp"
#include "symrig/projector/internal/driver.hpp"

#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig::projector::dlpc350 {
namespace {

std::uint8_t bit(bool set, unsigned place) {
  return static_cast<std::uint8_t>(set ? 1U << place : 0U);
}

}  // namespace

std::array<std::uint8_t, kEntryBytes> to_bytes(const TableEntry& entry) {
  const auto first = static_cast<unsigned>(entry.trigger) | static_cast<unsigned>(entry.plane & 0x3F) << 2U;
  const auto second =
      static_cast<unsigned>(entry.bits & 0xF) | static_cast<unsigned>(entry.leds & dlp::kAllLeds) << 4U;
  const auto third =
      bit(entry.inverted, 0) | bit(entry.black_after, 1) | bit(entry.swaps_buffer, 2) | bit(entry.joins, 3);
  return {static_cast<std::uint8_t>(first), static_cast<std::uint8_t>(second),
          static_cast<std::uint8_t>(third)};
}

TableEntry entry_of(std::span<const std::uint8_t, kEntryBytes> bytes) {
  TableEntry entry;
  entry.trigger = static_cast<Trigger>(bytes[0] & 3U);
  entry.plane = bytes[0] >> 2U;
  entry.bits = bytes[1] & 0xF;
  entry.leds = static_cast<std::uint8_t>(bytes[1] >> 4U & dlp::kAllLeds);
  entry.inverted = (bytes[2] & 1U) != 0;
  entry.black_after = (bytes[2] & 2U) != 0;
  entry.swaps_buffer = (bytes[2] & 4U) != 0;
  entry.joins = (bytes[2] & 8U) != 0;
  return entry;
}

std::vector<TableEntry> video_table(int planes, std::uint8_t leds) {
  std::vector<TableEntry> table(static_cast<std::size_t>(planes));
  for (int k = 0; k < planes; ++k) {
    TableEntry& entry = table[static_cast<std::size_t>(k)];
    entry.trigger = k == 0 ? Trigger::rising : Trigger::continues;
    entry.plane = k;
    entry.leds = leds;
    entry.swaps_buffer = k == 0;
    entry.black_after = k + 1 == planes;
  }
  return table;
}

Result<std::uint8_t> delay_code(Nanoseconds delay) {
  const auto units = std::lround(static_cast<double>(delay.count()) / kDelayUnit);
  const long code = kNoDelay + units;
  if (code >= 0 && code <= kMostDelay) return static_cast<std::uint8_t>(code);
  return Error{ErrorCode::bad_argument,
               fmt::format("a trigger output cannot be delayed by {:.2f} us",
                           1e-3 * static_cast<double>(delay.count())),
               "give -20.05 us to 2.78 us"};
}

namespace {

using dlp::Run;
using dlp::Steps;

/// Writes everything that a stopped sequence may change.
Result<void> write_sequence(Controller& controller, const SavedState& state) {
  Steps steps;
  steps.take([&] { return controller.set_source(state.source); });
  steps.take([&] { return controller.set_pattern_source(state.pattern_source); });
  steps.take([&] { return controller.set_trigger_mode(state.trigger_mode); });
  steps.take([&] { return controller.set_inverted(state.inverted); });
  steps.take([&] { return controller.set_times(state.times); });
  steps.take([&] { return controller.set_counts(state.counts); });
  steps.take([&] { return controller.set_table(state.table); });
  steps.take([&] { return controller.set_trigger_out(1, state.plane_trigger); });
  steps.take([&] { return controller.set_trigger_out(2, state.frame_trigger); });
  return std::move(steps).result();
}

/// A controller runs a sequence only after it has checked it.
Result<void> run_again(Controller& controller, const SavedState& state) {
  if (state.run == Run::stop) return {};
  SYMRIG_TRY(const Validation validation, controller.validate());
  if (!validation.ok())
    return Error{ErrorCode::device_refused,
                 controller.name() + " does not take its earlier sequence again: " + to_string(validation),
                 "start its sequence with the program that made it"};
  return controller.set_run(state.run);
}

}  // namespace

Result<SavedState> read_state(Controller& controller) {
  SavedState state;
  SYMRIG_TRY(state.shows_patterns, controller.shows_patterns());
  SYMRIG_TRY(state.source, controller.source());
  SYMRIG_TRY(state.pattern_source, controller.pattern_source());
  SYMRIG_TRY(state.trigger_mode, controller.trigger_mode());
  SYMRIG_TRY(state.inverted, controller.inverted());
  SYMRIG_TRY(state.times, controller.times());
  SYMRIG_TRY(state.counts, controller.counts());
  SYMRIG_TRY(state.table, controller.table(state.counts.entries));
  SYMRIG_TRY(state.plane_trigger, controller.trigger_out(1));
  SYMRIG_TRY(state.frame_trigger, controller.trigger_out(2));
  SYMRIG_TRY(state.led_enable, controller.led_enable());
  SYMRIG_TRY(state.led_currents, controller.led_currents());
  SYMRIG_TRY(state.run, controller.run());
  return state;
}

/// The LEDs go last into their earlier state: while the sequence changes, no LED is brighter than it was.
Result<void> restore_state(Controller& controller, const SavedState& state) {
  Steps steps;
  steps.take([&] { return controller.set_run(Run::stop); });
  steps.take([&] { return write_sequence(controller, state); });
  steps.take([&] { return controller.show_patterns(state.shows_patterns); });
  steps.take([&] { return controller.set_led_currents(state.led_currents); });
  steps.take([&] { return controller.set_led_enable(state.led_enable); });
  steps.take([&] { return run_again(controller, state); });
  return std::move(steps).result();
}

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

namespace symrig::projector {
namespace {

constexpr std::string_view kDriverDlpc350 = "dlpc350";

// The keys of `[projector]`: docs/rig-file.md.
std::unique_ptr<ProjectorSource> read_dlpc350_projector(base::TableReader& table) {
  dlp::PlaneKeys keys;
  keys.screen.mode = "912x1140@60";
  dlpc350::VideoPatternOptions sequence;
  dlp::read_plane_keys(table, keys, sequence);
  dlp::read_microseconds(table, "plane_exposure", sequence.exposure_us);
  constexpr std::array<std::pair<std::string_view, dlpc350::Port>, 2> kPorts{
      {{"parallel", dlpc350::Port::parallel}, {"fpd-link", dlpc350::Port::fpd_link}}};
  table.read_choice<dlpc350::Port>("port", sequence.port, kPorts);
  dlp::read_delay(table, "plane_delay_us", -20.05, 2.78, sequence.plane_delay);
  dlp::read_delay(table, "frame_delay_us", -20.05, 2.78, sequence.frame_delay);
  dlp::check_delays(table, sequence);
  using Source =
      dlp::PlaneSourceOf<dlpc350::VideoPatterns, dlpc350::Controller, dlpc350::VideoPatternOptions>;
  return std::make_unique<Source>(dlp::kDlpc350, kDriverDlpc350, std::move(keys), sequence);
}

}  // namespace

ProjectorDriver dlpc350_driver() {
  return {kDriverDlpc350, "a DLPC350 that splits the pictures of a screen into bit planes", "controller",
          read_dlpc350_projector};
}

}  // namespace symrig::projector
