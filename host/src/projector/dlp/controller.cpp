// SPDX-License-Identifier: Apache-2.0

#include "symrig/projector/internal/dlp.hpp"
#include "symrig/projector/internal/dlp_link.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::projector::dlp {
namespace {

/// Late replies that are dropped before a command counts as unanswered.
constexpr int kLateReplies = 16;

std::string command_text(Command command) {
  return fmt::format("command {:#06x}", static_cast<unsigned>(command));
}

}  // namespace

std::vector<Report> message_reports(std::uint8_t flags, std::uint8_t number,
                                    std::span<const std::uint8_t> body) {
  const std::size_t length = kHeadBytes + body.size();
  std::vector<Report> reports((length + kReportBytes - 1) / kReportBytes);
  reports[0] = {flags, number, static_cast<std::uint8_t>(body.size()),
                static_cast<std::uint8_t>(body.size() >> 8U)};
  for (std::size_t i = kHeadBytes; i < length; ++i)
    reports[i / kReportBytes][i % kReportBytes] = body[i - kHeadBytes];
  return reports;
}

Bytes command_body(Command command, std::span<const std::uint8_t> data) {
  const auto code = static_cast<std::uint16_t>(command);
  Bytes body(2 + data.size());
  body[0] = static_cast<std::uint8_t>(code);
  body[1] = static_cast<std::uint8_t>(code >> 8U);
  std::ranges::copy(data, body.begin() + 2);
  return body;
}

Dialogue::Dialogue(std::unique_ptr<HidTransport> transport, int firmware, Nanoseconds patience)
    : transport_(std::move(transport)), firmware_(firmware), patience_(patience) {}

std::string Dialogue::other_firmware() const {
  return fmt::format("update its firmware; symrig was written for version {}", firmware_);
}

Result<Bytes> Dialogue::read(Command command, std::size_t least) {
  SYMRIG_TRY(Reply got, exchange(kRead | kReplyAsked, command, {}));
  if (got.refused)
    return Error{ErrorCode::device_refused,
                 fmt::format("{} refused to read {}", name(), command_text(command)), other_firmware()};
  if (got.data.size() < least)
    return Error{ErrorCode::protocol,
                 fmt::format("{} answered {} with {} bytes instead of {}", name(), command_text(command),
                             got.data.size(), least),
                 other_firmware()};
  return std::move(got.data);
}

Result<void> Dialogue::write(Command command, std::span<const std::uint8_t> data) {
  SYMRIG_TRY(const Reply got, exchange(kReplyAsked, command, data));
  if (!got.refused) return {};
  return Error{ErrorCode::device_refused, fmt::format("{} refused {}", name(), command_text(command)),
               "check its video source and its settings"};
}

Result<Dialogue::Reply> Dialogue::exchange(std::uint8_t flags, Command command,
                                           std::span<const std::uint8_t> data) {
  ++number_;
  for (const Report& report : message_reports(flags, number_, command_body(command, data)))
    SYMRIG_CHECK(transport_->write(report));
  return reply(command);
}

Error Dialogue::silent(Command command) const {
  return {ErrorCode::timeout, fmt::format("{} did not answer {}", name(), command_text(command)),
          "disconnect its USB cable and its power, and connect them again"};
}

Result<Dialogue::Reply> Dialogue::reply(Command command) {
  for (int late = 0; late < kLateReplies; ++late) {
    auto first = transport_->read(patience_);
    if (!first) return first.error().code == ErrorCode::timeout ? silent(command) : first.error();
    const Report& head = *first;
    const std::size_t length = head[2] | std::size_t{head[3]} << 8U;
    Reply got{(head[0] & kRefused) != 0, {}};
    got.data.assign(head.begin() + kHeadBytes,
                    head.begin() + kHeadBytes + std::min(length, kReportBytes - kHeadBytes));
    while (got.data.size() < length) {
      auto more = transport_->read(patience_);
      if (!more) return more.error().code == ErrorCode::timeout ? silent(command) : more.error();
      got.data.insert(got.data.end(), more->begin(),
                      more->begin() + std::min(kReportBytes, length - got.data.size()));
    }
    if (head[1] == number_) return got;
  }
  return silent(command);
}

namespace {

constexpr std::size_t kVersionBytes = 16;

}  // namespace

std::string to_string(const Version& version) {
  return fmt::format("{}.{}.{}", version.major, version.minor, version.patch);
}

Result<std::uint8_t> Controller::byte(Command command) {
  SYMRIG_TRY(const Bytes data, dialogue_.read(command, 1));
  return data[0];
}

Result<Version> Controller::version() {
  SYMRIG_TRY(const Bytes data, dialogue_.read(Command::version, kVersionBytes));
  return Version{data[3], data[2], half(data, 0)};
}

Result<Status> Controller::status() {
  Status status;
  SYMRIG_TRY(status.hardware, byte(Command::hardware_status));
  SYMRIG_TRY(status.system, byte(Command::system_status));
  SYMRIG_TRY(status.main, byte(Command::main_status));
  return status;
}

Result<bool> Controller::standby() {
  SYMRIG_TRY(const std::uint8_t power, byte(Command::power));
  return (power & 3U) != 0;
}

Result<std::uint8_t> Controller::source() {
  return byte(Command::source);
}

Result<void> Controller::set_source(std::uint8_t source) {
  return dialogue_.write(Command::source, source);
}

Result<LedEnable> Controller::led_enable() {
  SYMRIG_TRY(const std::uint8_t bits, byte(Command::led_enable));
  return LedEnable{static_cast<std::uint8_t>(bits & kAllLeds), (bits & 8U) != 0};
}

Result<void> Controller::set_led_enable(const LedEnable& enable) {
  return dialogue_.write(Command::led_enable,
                         static_cast<std::uint8_t>((enable.leds & kAllLeds) | (enable.by_sequencer ? 8 : 0)));
}

Result<LedCurrents> Controller::led_currents() {
  SYMRIG_TRY(const Bytes data, dialogue_.read(Command::led_current, 3));
  return LedCurrents{data[0], data[1], data[2]};
}

Result<void> Controller::set_led_currents(const LedCurrents& currents) {
  return dialogue_.write(Command::led_current, currents);
}

Result<void> Controller::set_run(Run run) {
  return dialogue_.write(Command::run, static_cast<std::uint8_t>(run));
}

Result<void> check_ready(Controller& controller) {
  SYMRIG_TRY(const bool standby, controller.standby());
  if (standby)
    return Error{ErrorCode::device_refused, fmt::format("{} is in standby", controller.name()),
                 "switch the projector on"};
  SYMRIG_TRY(const Status status, controller.status());
  if (status.initialized() && !status.sequencer_error()) return {};
  return Error{ErrorCode::device_refused,
               fmt::format("{} reports {} (hardware status {:#04x})", controller.name(),
                           status.initialized() ? "an error of its sequencer" : "that it is not initialized",
                           status.hardware),
               "disconnect its power, and connect it again"};
}

namespace {

std::string leds_text(const LedEnable& enable) {
  if (enable.by_sequencer) return "sequence";
  constexpr std::array<std::string_view, 3> kNames{"red", "green", "blue"};
  std::vector<std::string_view> on;
  for (std::size_t k = 0; k < kNames.size(); ++k)
    if ((enable.leds >> k & 1U) != 0) on.push_back(kNames[k]);
  return on.empty() ? "none" : fmt::format("{}", fmt::join(on, " "));
}

}  // namespace

Result<void> look_at_common(Controller& controller, DlpController& found) {
  SYMRIG_TRY(const Version version, controller.version());
  found.firmware = to_string(version);
  SYMRIG_TRY(found.standby, controller.standby());
  SYMRIG_TRY(const Status status, controller.status());
  found.parked = status.parked();
  found.healthy = status.initialized() && !status.sequencer_error() && !status.sequencer_aborted();
  SYMRIG_TRY(const LedEnable enable, controller.led_enable());
  found.leds = leds_text(enable);
  SYMRIG_TRY(const LedCurrents currents, controller.led_currents());
  found.currents = {currents[0], currents[1], currents[2]};
  return {};
}

namespace {

/// A source and a mode that differ by more are two modes. 59.94 and 60 Hz differ by 0.1 %.
constexpr double kSameRefresh = 0.005;

}  // namespace

/// A source of 120 Hz shows each picture of a 60 Hz program twice, and its planes take half the time.
Result<void> check_signal(const std::string& controller, const Signal& signal, const PictureSource& source,
                          Grid mirrors) {
  const double wanted = 1 / seconds(source.refresh);
  if (!signal.locked)
    return Error{ErrorCode::device_refused, fmt::format("{} receives no stable video signal", controller),
                 "connect the screen's cable to it"};
  if (source.grid != mirrors || signal.rows != mirrors.rows || signal.cols != mirrors.cols)
    return Error{
        ErrorCode::device_refused,
        fmt::format("{} receives {}x{} of a screen of {}x{}, and shows bit planes only of {}x{}", controller,
                    signal.cols, signal.rows, source.grid.cols, source.grid.rows, mirrors.cols, mirrors.rows),
        fmt::format("set projector.mode = \"{}x{}@60\"", mirrors.cols, mirrors.rows)};
  if (signal.refresh_hz > 0 && std::abs(signal.refresh_hz / wanted - 1) <= kSameRefresh) return {};
  return Error{ErrorCode::device_refused,
               fmt::format("{} receives {:.4g} pictures a second, but the screen's mode has {:.4g}",
                           controller, signal.refresh_hz, wanted),
               "connect the cable of the screen that the rig file names, or set its mode"};
}

Result<void> await_signal(const std::function<Result<void>()>& check, Nanoseconds patience) {
  constexpr Nanoseconds kPause{100'000'000};
  for (Nanoseconds waited{0};; waited += kPause) {
    auto checked = check();
    if (checked || checked.error().code != ErrorCode::device_refused || waited >= patience) return checked;
    std::this_thread::sleep_for(kPause);
  }
}

}  // namespace symrig::projector::dlp
