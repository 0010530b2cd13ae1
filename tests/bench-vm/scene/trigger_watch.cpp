// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/watchers.hpp"
#include "symrig/base/files.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

namespace symrig::bench_vm {

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
