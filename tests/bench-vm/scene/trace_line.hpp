// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/units.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace symrig::bench_vm {

/// Somebody set an output line. The kernel's tracer tells of every call, also where the level stays.
struct LineSet {
  int gpio = 0;  ///< the kernel's global number of the line
  bool level = false;
  Nanoseconds time{};  ///< CLOCK_MONOTONIC, whole microseconds: what trace_pipe prints
  bool operator==(const LineSet&) const = default;
};

/// The tracer's buffer overflowed: nobody knows which lines were set meanwhile.
struct EventsLost {
  std::uint64_t count = 0;
  bool operator==(const EventsLost&) const = default;
};

/// Neither: a reading of a line, another event, a comment.
using TraceEvent = std::variant<std::monostate, LineSet, EventsLost>;

/// One line of tracefs' trace_pipe with trace_clock=mono, without its line feed.
/// source: Linux 6.1, include/trace/events/gpio.h (gpio_value), kernel/trace/trace.c ("LOST n EVENTS").
TraceEvent parse_trace_line(std::string_view line);

/// Cuts what read() returns into whole lines; the rest waits for the next piece.
class LineSplitter {
 public:
  /// The lines that end in this piece, in order, without their line feeds.
  std::vector<std::string> feed(std::string_view piece);

 private:
  std::string rest_;
};

}  // namespace symrig::bench_vm
