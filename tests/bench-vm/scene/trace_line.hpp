// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/time.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace symrig::bench_vm {

/// An output line was set. The kernel's trace has every call, even if the level does not change.
struct LineSet {
  int gpio = 0;  ///< the kernel's global number of the line
  bool level = false;
  Nanoseconds time{};  ///< CLOCK_MONOTONIC, whole microseconds, as trace_pipe prints
  bool operator==(const LineSet&) const = default;
};

/// The trace buffer overflowed: it is unknown which lines were set in the meantime.
struct EventsLost {
  std::uint64_t count = 0;
  bool operator==(const EventsLost&) const = default;
};

/// monostate: a reading of a line, another event, or a comment.
using TraceEvent = std::variant<std::monostate, LineSet, EventsLost>;

/// One line of tracefs' trace_pipe with trace_clock=mono, without its line feed.
/// source: Linux 6.1, include/trace/events/gpio.h (gpio_value), kernel/trace/trace.c ("LOST n EVENTS").
TraceEvent parse_trace_line(std::string_view line);

/// Joins the pieces that read() returns to complete lines. The rest waits for the next piece.
class LineSplitter {
 public:
  /// The lines that end in this piece, in order, without line feeds.
  std::vector<std::string> feed(std::string_view piece);

 private:
  std::string rest_;
};

}  // namespace symrig::bench_vm
