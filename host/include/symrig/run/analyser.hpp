// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/program/timeline.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// What a logic analyser saw.
struct AnalyserCapture {
  struct Edge {
    double ns = 0;  ///< since the file's time 0
    std::size_t channel = 0;
    bool level = false;
  };
  std::vector<std::string> channels;
  std::vector<Edge> edges;  ///< in order of time
  double resolution_ns =
      0;  ///< the sample period if the file names its rate, as sigrok's do; else the time unit
};

/// Reads a VCD file (IEEE 1364-2005 section 18): wires of one bit. A channel's first value is no edge. Wider
/// variables and real numbers are ignored.
/// fails: bad_format (names the line).
Result<AnalyserCapture> read_analyser_vcd(std::string_view text);

/// A line of the board, and the analyser's name for the channel at it.
struct ChannelName {
  std::string line, channel;
};

/// A planned edge and what the analyser saw, in nanoseconds since the first planned edge.
struct AnalyserPair {
  int line = 0;
  bool level = false;
  double planned_ns = 0;
  double seen_ns = 0;        ///< on the analyser's clock
  double difference_ns = 0;  ///< seen minus planned, without the difference of the clocks' rates
};

struct AnalyserComparison {
  std::vector<int> lines;   ///< compared lines of the board
  std::vector<int> unseen;  ///< lines that the plan moves and no channel shows
  std::vector<AnalyserPair> pairs;
  std::size_t missing = 0;    ///< planned, not seen
  std::size_t unplanned = 0;  ///< seen during the run, not planned
  std::size_t outside = 0;    ///< seen before or after the run
  double rate_ppm = 0;        ///< the analyser's clock against the board's; positive: it counts faster
  double largest_ns = 0;      ///< of |difference_ns|
  double allowed_ns = 0;      ///< one sample, one tick, and the board's lateness; or as asked for

  bool agrees() const { return missing == 0 && unplanned == 0 && largest_ns <= allowed_ns; }
};

/// Compares a plan with a capture. The two have no common time 0: the run is laid where most edges fit. Their
/// clocks differ in rate: a line is fitted through the pairs (at most 1,000 ppm), and what is left is the
/// difference. names: channels whose names are not those of their lines.
/// allowed: the largest difference; none = as AnalyserComparison::allowed_ns says.
/// fails: unknown_name (no such line or channel), bad_value (no line of the plan is in the capture, or the
/// capture has no edge there).
Result<AnalyserComparison> compare_with_analyser(const Timeline& plan, const BoardInfo& board,
                                                 const AnalyserCapture& capture,
                                                 std::span<const ChannelName> names,
                                                 std::optional<Nanoseconds> allowed = {});

}  // namespace symrig
