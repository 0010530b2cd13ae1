// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/screen_reader.hpp"
#include "bench-vm/scene/screen_timeline.hpp"
#include "symrig/base/time.hpp"

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace symrig::bench_vm {

/// The sequence that a controller shows in each refresh. Its trigger outputs are wired to the lines `plane`
/// (an edge at each plane) and `vsync` (an edge before the first plane).
struct ShownSequence {
  std::vector<int> planes;    ///< numbers of the bits, in order
  Nanoseconds period{0};      ///< from plane to plane
  Nanoseconds exposure{0};    ///< how long a plane is bright
  Nanoseconds frame_lead{0};  ///< from the frame trigger to the first plane
  bool frames_all = false;    ///< the frame trigger lasts to the end of the last plane, not only a pulse
};

/// The middle pixel of each cell, 0x00RRGGBB.
std::vector<std::uint32_t> cell_words(const ScanoutPixels& pixels, const Placement& placement);
/// The bit of a word that is plane `number` of a controller: G0 to G7, R0 to R7, B0 to B7.
int bit_of(int number);

/// Light and its begin.
using Change = std::pair<Nanoseconds, Picture>;
/// What is bright from `start` on, the begin of the first plane, until the next refresh.
std::vector<Change> light_of_planes(std::span<const std::uint32_t> words, Grid grid,
                                    const ShownSequence& sequence, Nanoseconds start);

/// A level of a trigger output.
struct TriggerEdge {
  enum class Line : std::uint8_t { frame, plane };
  Nanoseconds at{0};
  Line line = Line::plane;
  bool high = false;
};
/// The edges of a refresh whose first plane begins at `start`, in order of time.
std::vector<TriggerEdge> edges_of_refresh(const ShownSequence& sequence, Nanoseconds start);

}  // namespace symrig::bench_vm
