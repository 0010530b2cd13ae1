// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/plane_light.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

namespace symrig::bench_vm {

namespace {

constexpr Nanoseconds kTriggerPulse{100'000};

std::uint32_t word_at(const ScanoutPixels& pixels, int row, int col) {
  std::uint32_t word = 0;
  if (row < 0 || col < 0 || row >= pixels.rows || col >= pixels.cols) return word;
  std::memcpy(&word,
              pixels.first + static_cast<std::size_t>(row) * pixels.pitch +
                  static_cast<std::size_t>(col) * sizeof word,
              sizeof word);
  return word;
}

Picture plane_of(std::span<const std::uint32_t> words, Grid grid, int number) {
  auto picture = std::make_shared<Image<float>>(grid, 1);
  const auto bit = static_cast<unsigned>(bit_of(number));
  std::ranges::transform(words, picture->values().begin(),
                         [bit](std::uint32_t word) { return static_cast<float>(word >> bit & 1U); });
  return picture;
}

}  // namespace

std::vector<std::uint32_t> cell_words(const ScanoutPixels& pixels, const Placement& placement) {
  std::vector<std::uint32_t> words;
  words.reserve(placement.grid.size());
  const int middle = placement.cell / 2;
  for (int row = 0; row < placement.grid.rows; ++row)
    for (int col = 0; col < placement.grid.cols; ++col)
      words.push_back(word_at(pixels, placement.top + row * placement.cell + middle,
                              placement.left + col * placement.cell + middle));
  return words;
}

int bit_of(int number) {
  constexpr std::array kFirst{8, 16, 0};  // of green, red, blue
  return kFirst.at(static_cast<std::size_t>(number / 8)) + number % 8;
}

std::vector<Change> light_of_planes(std::span<const std::uint32_t> words, Grid grid,
                                    const ShownSequence& sequence, Nanoseconds start) {
  const auto dark = std::make_shared<const Image<float>>(grid, 1);
  std::vector<Change> changes;
  for (std::size_t k = 0; k < sequence.planes.size(); ++k) {
    const Nanoseconds begin = start + static_cast<std::int64_t>(k) * sequence.period;
    changes.emplace_back(begin, plane_of(words, grid, sequence.planes[k]));
    if (sequence.exposure < sequence.period) changes.emplace_back(begin + sequence.exposure, dark);
  }
  changes.emplace_back(start + static_cast<std::int64_t>(sequence.planes.size()) * sequence.period, dark);
  return changes;
}

std::vector<TriggerEdge> edges_of_refresh(const ShownSequence& sequence, Nanoseconds start) {
  using Line = TriggerEdge::Line;
  const Nanoseconds frame = start - sequence.frame_lead;
  const Nanoseconds last = start + static_cast<std::int64_t>(sequence.planes.size()) * sequence.period;
  std::vector<TriggerEdge> edges{{frame, Line::frame, true},
                                 {sequence.frames_all ? last : frame + kTriggerPulse, Line::frame, false}};
  for (std::size_t k = 0; k < sequence.planes.size(); ++k) {
    const Nanoseconds begin = start + static_cast<std::int64_t>(k) * sequence.period;
    edges.push_back({begin, Line::plane, true});
    edges.push_back({begin + kTriggerPulse, Line::plane, false});
  }
  std::ranges::stable_sort(edges, {}, &TriggerEdge::at);
  return edges;
}

}  // namespace symrig::bench_vm
