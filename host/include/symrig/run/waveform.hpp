// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"
#include "symrig/program/timeline.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// Some lines over time, for a drawing.
struct Waveform {
  std::string name;  ///< "plan", "actual"
  TickRate rate;
  Ticks origin;  ///< time 0 of the drawing; edges before it are drawn at 0
  Ticks end;
  std::uint32_t initial_levels = 0;  ///< bit k = line k
  std::vector<int> lines;            ///< numbers of the board's lines, in the order of drawing
  std::vector<std::string> names;    ///< names of those lines
  std::vector<CapturedEdge> edges;   ///< sorted by time
};

/// The planned edges of all outputs that change.
Waveform waveform(const Timeline& plan, const BoardInfo& board, std::string name);

/// The text of a VCD file (IEEE 1364-2005 §18) with one scope for each waveform; they share time 0. The time
/// unit is 1 ns if that holds all ticks exactly, else 1 ps. The same waveforms give the same bytes.
std::string vcd_text(std::span<const Waveform> waveforms);

/// WaveJSON for WaveDrom: one column for each moment with a change, so that microseconds and seconds fit into
/// one picture. The first row contains the times. If there are more than `max_columns` moments, the rest is
/// omitted, and the foot gives both numbers.
std::string wavedrom_text(std::span<const Waveform> waveforms, std::size_t max_columns = 200);

}  // namespace symrig
