// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/watchers.hpp"
#include "symrig/base/files.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <optional>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

namespace symrig::bench_vm {

Shutter::Move Shutter::trigger(bool level, Nanoseconds at, bool sees) {
  if (level == level_) return Move::none;
  level_ = level;
  triggers_ += level ? 1 : 0;
  if (level && !sees) {
    ++unseen_;
    return Move::none;
  }
  if (level && at < busy_until_) {
    ++missed_;
    return Move::none;
  }
  if (level) {
    open_ = true;
    return Move::open;
  }
  if (!open_) return Move::none;
  open_ = false;
  busy_until_ = at + readout_;
  return Move::close;
}

namespace {

/// Removes a whole number from the front of the text.
template <class T>
std::optional<T> take_number(std::string_view& text) {
  T value{};
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{}) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(stop - text.data()));
  return value;
}

bool take(std::string_view& text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return false;
  text.remove_prefix(prefix.size());
  return true;
}

/// "1234.567890", the last word before the event's name.
std::optional<Nanoseconds> parse_time(std::string_view before) {
  const std::size_t space = before.rfind(' ');
  std::string_view text = space == std::string_view::npos ? before : before.substr(space + 1);
  const auto whole = take_number<std::int64_t>(text);
  if (!whole || !take(text, ".") || text.size() != 6) return std::nullopt;
  const auto microseconds = take_number<std::int64_t>(text);
  if (!microseconds || !text.empty()) return std::nullopt;
  return Nanoseconds{*whole * 1'000'000'000 + *microseconds * 1'000};
}

/// "503 set 1"
std::optional<std::pair<int, bool>> parse_set(std::string_view text) {
  const auto gpio = take_number<int>(text);
  if (!gpio || !take(text, " set ")) return std::nullopt;
  const auto level = take_number<int>(text);
  if (!level) return std::nullopt;
  return std::pair{*gpio, *level != 0};
}

}  // namespace

TraceEvent parse_trace_line(std::string_view line) {
  constexpr std::string_view kLost = "[LOST ";
  constexpr std::string_view kValue = ": gpio_value: ";
  if (const std::size_t at = line.find(kLost); at != std::string_view::npos) {
    line.remove_prefix(at + kLost.size());
    return EventsLost{take_number<std::uint64_t>(line).value_or(1)};
  }
  const std::size_t at = line.find(kValue);
  if (at == std::string_view::npos) return std::monostate{};
  const auto time = parse_time(line.substr(0, at));
  const auto set = parse_set(line.substr(at + kValue.size()));
  if (!time || !set) return std::monostate{};
  return LineSet{set->first, set->second, *time};
}

std::vector<std::string> LineSplitter::feed(std::string_view piece) {
  std::vector<std::string> lines;
  for (std::size_t end = piece.find('\n'); end != std::string_view::npos; end = piece.find('\n')) {
    rest_.append(piece.substr(0, end));
    lines.push_back(std::exchange(rest_, {}));
    piece.remove_prefix(end + 1);
  }
  rest_.append(piece);
  return lines;
}

namespace {

/// Below the board's player and main loop (50, 49), because a real camera takes no time from them.
constexpr int kPriority = 48;
constexpr int kStopLatencyMs = 100;  // interval in which poll() checks for the end

}  // namespace

Result<TriggerWatch> TriggerWatch::open(const BenchPlaces& places, Nanoseconds readout,
                                        const FaultRates& faults, Stage& stage) {
  SYMRIG_TRY(const int line, places.line("camera_trigger"));
  SYMRIG_TRY(InputWire strobe, InputWire::open(places, "camera_strobe"));
  const std::string path = places.tracefs + "/trace_pipe";
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-vararg)
  Fd trace(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  if (!trace) return system_error(fmt::format("cannot open {}", path), "only one reader at a time");
  return TriggerWatch(std::move(trace), std::move(strobe), places.gpio_base + line, readout, faults, stage);
}

void TriggerWatch::run() {
  if (auto first = set_priority(kPriority); !first) return stage_.stop(first.error());
  while (!stage_.stopped())
    if (auto read = read_on(); !read) stage_.stop(read.error());
}

Result<void> TriggerWatch::read_on() {
  pollfd waiting{trace_.get(), POLLIN, 0};
  if (::poll(&waiting, 1, kStopLatencyMs) <= 0) return {};
  std::array<char, 4096> piece{};
  const ssize_t size = ::read(trace_.get(), piece.data(), piece.size());
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return {};
  if (size < 0) return system_error("cannot read the kernel's trace", "");
  for (const std::string& line : lines_.feed({piece.data(), static_cast<std::size_t>(size)}))
    SYMRIG_CHECK(take(parse_trace_line(line)));
  return {};
}

Result<void> TriggerWatch::take(const TraceEvent& event) {
  if (const auto* lost = std::get_if<EventsLost>(&event))
    return Error{ErrorCode::fault, fmt::format("the kernel's trace lost {} events", lost->count),
                 "this run proves nothing: make the trace buffer larger"};
  const auto* set = std::get_if<LineSet>(&event);
  if (set == nullptr || set->gpio != gpio_) return {};
  return move(*set);
}

Result<void> TriggerWatch::move(const LineSet& set) {
  if (set.level && !stage_.camera_is_in()) return {};
  const Shutter::Move move =
      shutter_.trigger(set.level, set.time, sees_trigger(faults_, shutter_.triggers()));
  if (move == Shutter::Move::none) return {};
  SYMRIG_TRY(const Moment edge, pull_undisturbed(strobe_, move == Shutter::Move::open, kPriority));
  slowest_ = std::max(slowest_, edge.time - set.time);
  if (move == Shutter::Move::open)
    begin_ = edge;
  else
    stage_.exposed({exposures_++, begin_, edge});
  return {};
}

}  // namespace symrig::bench_vm
