// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/plane_light.hpp"

#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm::plane_light_test {
namespace {

using namespace std::chrono_literals;
using Line = TriggerEdge::Line;

constexpr Grid kGrid{2, 3};

ShownSequence sequence() {
  ShownSequence sequence{{}, 684us, 684us, 20us};
  for (int k = 0; k < 24; ++k) sequence.planes.push_back(k);
  return sequence;
}

TEST(PlaneLight, reads_the_middle_of_each_cell) {
  constexpr int kCell = 5, kRows = 2 * kCell + 1, kCols = 3 * kCell + 2;
  std::vector<std::uint32_t> memory;
  for (int row = 0; row < kRows; ++row)
    for (int col = 0; col < kCols; ++col) memory.push_back(static_cast<std::uint32_t>(100 * row + col));
  const ScanoutPixels pixels{reinterpret_cast<const std::byte*>(memory.data()), std::size_t{kCols} * 4, kRows,
                             kCols};
  EXPECT_EQ(cell_words(pixels, {kGrid, kCell, 1, 2}),
            (std::vector<std::uint32_t>{304, 309, 314, 804, 809, 814}));
}

TEST(PlaneLight, the_planes_are_the_bits_of_green_red_and_blue) {
  EXPECT_EQ(bit_of(0), 8);
  EXPECT_EQ(bit_of(7), 15);
  EXPECT_EQ(bit_of(8), 16);
  EXPECT_EQ(bit_of(15), 23);
  EXPECT_EQ(bit_of(16), 0);
  EXPECT_EQ(bit_of(23), 7);
  std::set<int> bits;
  for (int k = 0; k < 24; ++k) bits.insert(bit_of(k));
  EXPECT_EQ(bits.size(), 24U);
}

// Cell k is bright in planes k, k + 6, ... only.
TEST(PlaneLight, each_plane_is_bright_in_its_turn_and_the_rest_of_the_refresh_is_dark) {
  std::vector<std::uint32_t> words(kGrid.size());
  for (int plane = 0; plane < 24; ++plane)
    words[static_cast<std::size_t>(plane % 6)] |= 1U << static_cast<unsigned>(bit_of(plane));
  const auto changes = light_of_planes(words, kGrid, sequence(), 1s);
  ASSERT_EQ(changes.size(), 25U);
  for (std::size_t k = 0; k < changes.size(); ++k) {
    EXPECT_EQ(changes[k].first, 1s + static_cast<std::int64_t>(k) * 684us);
    for (std::size_t cell = 0; cell < 6; ++cell)
      EXPECT_EQ(changes[k].second->values()[cell], k < 24 && k % 6 == cell ? 1 : 0) << k << " " << cell;
  }
}

TEST(PlaneLight, planes_that_are_shorter_than_their_period_end_in_the_dark) {
  ShownSequence shorter = sequence();
  shorter.exposure = 400us;
  const std::vector<std::uint32_t> words(kGrid.size(), 0xFFFFFFU);
  const auto changes = light_of_planes(words, kGrid, shorter, 1s);
  ASSERT_EQ(changes.size(), 49U);
  EXPECT_EQ(changes[0].second->values()[0], 1);
  EXPECT_EQ(changes[1].first, 1s + 400us);
  EXPECT_EQ(changes[1].second->values()[0], 0);
  EXPECT_EQ(changes[2].first, 1s + 684us);
}

TEST(PlaneLight, an_edge_begins_each_plane_and_one_comes_before_the_first) {
  const auto edges = edges_of_refresh(sequence(), 1s);
  ASSERT_EQ(edges.size(), 50U);
  std::vector<Nanoseconds> planes;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    EXPECT_GE(edges[k].at, edges[k > 0 ? k - 1 : 0].at);
    if (edges[k].line == Line::plane && edges[k].high) planes.push_back(edges[k].at);
  }
  EXPECT_EQ(edges[0].line, Line::frame);
  EXPECT_TRUE(edges[0].high);
  EXPECT_EQ(edges[0].at, 1s - 20us);
  ASSERT_EQ(planes.size(), 24U);
  for (std::size_t k = 0; k < 24; ++k) EXPECT_EQ(planes[k], 1s + static_cast<std::int64_t>(k) * 684us);
}

// As a DLPC900 frames its planes.
TEST(PlaneLight, a_frame_trigger_may_last_to_the_end_of_the_last_plane) {
  ShownSequence framing = sequence();
  framing.frames_all = true;
  const auto edges = edges_of_refresh(framing, 1s);
  ASSERT_EQ(edges.size(), 50U);
  EXPECT_EQ(edges.front().at, 1s - 20us);
  EXPECT_EQ(edges.back().line, Line::frame);
  EXPECT_FALSE(edges.back().high);
  EXPECT_EQ(edges.back().at, 1s + 24 * 684us);
}

}  // namespace
}  // namespace symrig::bench_vm::plane_light_test
