// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/screen_reader.hpp"
#include "bench-vm/scene/tests/looped_rig.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm::screens_test {
namespace {

using namespace std::chrono_literals;

Picture picture(float value) {
  return std::make_shared<const Image<float>>(Grid{2, 2}, 1, value);
}

using Shares = std::vector<std::pair<std::uint64_t, double>>;
Shares shares(const ScreenTimeline& timeline, Nanoseconds begin, Nanoseconds end) {
  Shares all;
  for (const auto& lit : timeline.during(begin, end)) all.emplace_back(lit.number, lit.share);
  return all;
}

ScreenTimeline three() {
  ScreenTimeline timeline;
  EXPECT_TRUE(timeline.change(10ms, picture(0)));
  EXPECT_TRUE(timeline.change(20ms, picture(1)));
  EXPECT_TRUE(timeline.change(40ms, picture(0.5F)));
  return timeline;
}

TEST(ScreenTimeline, mixes_pictures_by_their_share_of_the_time) {
  const ScreenTimeline timeline = three();
  EXPECT_EQ(shares(timeline, 22ms, 38ms), (Shares{{1, 1.0}}));
  EXPECT_EQ(shares(timeline, 20ms, 40ms), (Shares{{1, 1.0}}));  // the end does not count
  EXPECT_EQ(shares(timeline, 15ms, 55ms), (Shares{{0, 0.125}, {1, 0.5}, {2, 0.375}}));
  EXPECT_EQ(shares(timeline, 5ms, 15ms), (Shares{{0, 0.5}}));  // before the first picture there is no light
  EXPECT_EQ(shares(timeline, 1ms, 9ms), (Shares{}));
  EXPECT_EQ(shares(timeline, 50ms, 90ms), (Shares{{2, 1.0}}));
}

TEST(ScreenTimeline, takes_the_same_picture_for_no_change) {
  ScreenTimeline timeline;
  EXPECT_FALSE(timeline.change(1ms, nullptr));
  EXPECT_TRUE(timeline.change(10ms, picture(1)));
  EXPECT_FALSE(timeline.change(20ms, picture(1)));  // other memory, same values
  EXPECT_EQ(shares(timeline, 15ms, 25ms), (Shares{{0, 1.0}}));
}

TEST(ScreenTimeline, is_dark_while_the_screen_is_off) {
  ScreenTimeline timeline = three();
  EXPECT_TRUE(timeline.change(60ms, nullptr));
  EXPECT_FALSE(timeline.change(65ms, nullptr));
  EXPECT_TRUE(timeline.change(80ms, picture(0.5F)));  // the same picture again, after none
  EXPECT_EQ(shares(timeline, 50ms, 90ms), (Shares{{2, 0.25}, {3, 0.25}}));
  EXPECT_EQ(timeline.newest().number, 3U);
}

TEST(ScreenTimeline, forgets_only_what_was_gone) {
  ScreenTimeline timeline = three();
  const Shares before = shares(timeline, 30ms, 50ms);
  timeline.forget_before(30ms);
  EXPECT_EQ(shares(timeline, 30ms, 50ms), before);
  EXPECT_EQ(shares(timeline, 15ms, 25ms), (Shares{{1, 0.5}}));  // the first picture is forgotten
  timeline.forget_before(100ms);
  EXPECT_EQ(shares(timeline, 110ms, 120ms), (Shares{{2, 1.0}}));
}

Picture picture(float left, float right) {
  Image<float> image(Grid{2, 2}, 1);
  for (std::size_t i = 0; i < 4; ++i) image.values()[i] = i % 2 == 0 ? left : right;
  return std::make_shared<const Image<float>>(std::move(image));
}

std::vector<float> values_of(const ScreenTimeline::Lit& lit) {
  return {lit.pattern->values().begin(), lit.pattern->values().end()};
}

// Two screens that refresh at different times: while only the left one has changed, the scene sees the new
// picture beside the old one.
TEST(JoinedScreens, change_one_after_the_other) {
  JoinedScreens screens(2);
  screens.change(0, 10ns, picture(1, 2));
  screens.change(1, 10ns, picture(3, 4));
  screens.change(0, 100ns, picture(5, 6));
  screens.change(1, 107ns, picture(7, 8));
  const auto lit = screens.during(80ns, 120ns);
  ASSERT_EQ(lit.size(), 3U);
  EXPECT_EQ(values_of(lit[0]), (std::vector<float>{1, 2, 3, 4, 1, 2, 3, 4}));
  EXPECT_EQ(values_of(lit[1]), (std::vector<float>{5, 6, 3, 4, 5, 6, 3, 4}));
  EXPECT_EQ(values_of(lit[2]), (std::vector<float>{5, 6, 7, 8, 5, 6, 7, 8}));
  EXPECT_DOUBLE_EQ(lit[0].share, 0.5);
  EXPECT_DOUBLE_EQ(lit[1].share, 7.0 / 40);
  EXPECT_DOUBLE_EQ(lit[2].share, 13.0 / 40);
  EXPECT_EQ(values_of(screens.newest()), values_of(lit[2]));
}

// Its light is computed once: number and picture stay.
TEST(JoinedScreens, stay_one_picture_while_nothing_changes) {
  JoinedScreens screens(2);
  screens.change(0, 10ns, picture(1, 2));
  screens.change(1, 20ns, picture(3, 4));
  const auto first = screens.during(30ns, 40ns), second = screens.during(50ns, 60ns);
  ASSERT_EQ(first.size(), 1U);
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(first[0].share, 1);
  EXPECT_EQ(first[0].number, second[0].number);
  EXPECT_EQ(first[0].pattern, second[0].pattern);
  screens.forget_before(60ns);
  EXPECT_EQ(screens.during(60ns, 70ns)[0].number, first[0].number);
}

TEST(JoinedScreens, are_dark_where_one_is_off) {
  JoinedScreens screens(2);
  EXPECT_TRUE(screens.during(0ns, 10ns).empty());
  EXPECT_EQ(screens.newest().pattern, nullptr);
  screens.change(1, 20ns, picture(3, 4));
  EXPECT_EQ(values_of(screens.newest()), (std::vector<float>{0, 0, 3, 4, 0, 0, 3, 4}));
}

/// A screen in memory whose rows are longer than the visible part.
struct FakeScreen {
  int rows, cols;
  std::size_t pitch;
  std::vector<std::uint32_t> memory;

  FakeScreen(int rows_, int cols_)
      : rows(rows_),
        cols(cols_),
        pitch((static_cast<std::size_t>(cols_) + 5) * 4),
        memory((static_cast<std::size_t>(cols_) + 5) * rows_, 0xff123456U) {}
  std::uint32_t& at(int row, int col) { return memory[static_cast<std::size_t>(row) * (pitch / 4) + col]; }
  ScanoutPixels pixels() const {
    return {reinterpret_cast<const std::byte*>(memory.data()), pitch, rows, cols};
  }
  void show(const Placement& placement, const std::vector<int>& codes) {
    for (int row = 0; row < placement.grid.rows * placement.cell; ++row)
      for (int col = 0; col < placement.grid.cols * placement.cell; ++col) {
        const int pixel = row / placement.cell * placement.grid.cols + col / placement.cell;
        at(placement.top + row, placement.left + col) =
            0xff000000U | static_cast<std::uint32_t>(codes[pixel]) * 0x010101U;
      }
  }
};

// All 256 codes of a grey pixel give exactly code/255.
TEST(ScreenLight, reads_every_code_exactly) {
  const Placement placement{{16, 16}, 3, 2, 5};
  FakeScreen screen(60, 70);
  std::vector<int> codes(256);
  for (int i = 0; i < 256; ++i) codes[i] = i;
  screen.show(placement, codes);
  const Image<float> light = light_on_grid(screen.pixels(), placement);
  for (int i = 0; i < 256; ++i) EXPECT_EQ(light.values()[i], static_cast<float>(i / 255.0)) << i;
}

// A pattern that is shifted by one pixel gives mixed cells, not the pattern.
TEST(ScreenLight, is_the_mean_of_a_cell) {
  const Placement placement{{2, 2}, 4, 0, 0};
  FakeScreen screen(8, 9);
  screen.show({{2, 2}, 4, 0, 1}, {255, 0, 0, 255});
  for (int row = 0; row < 8; ++row) screen.at(row, 0) = 0;
  const Image<float> light = light_on_grid(screen.pixels(), placement);
  EXPECT_FLOAT_EQ(light.at(0, 0), 0.75F);
  EXPECT_FLOAT_EQ(light.at(0, 1), 0.25F);
  EXPECT_FLOAT_EQ(light.at(1, 0), 0.F);
  EXPECT_FLOAT_EQ(light.at(1, 1), 0.75F);
}

TEST(ScreenLight, never_reads_past_the_screen) {
  FakeScreen screen(8, 8);
  screen.show({{2, 2}, 4, 0, 0}, {255, 255, 255, 255});
  const Image<float> light = light_on_grid(screen.pixels(), {{3, 2}, 4, -2, 6});
  EXPECT_FLOAT_EQ(light.at(0, 0), 0.25F);  // 2 × 2 of its 4 × 4 pixels are on the screen
  EXPECT_FLOAT_EQ(light.at(1, 0), 0.5F);
  EXPECT_EQ(light.at(0, 1), 0.F);
}

TEST(ScreenLight, a_glance_sees_a_changed_cell) {
  const Placement placement{{3, 4}, 3, 1, 1};
  FakeScreen screen(11, 14);
  std::vector<int> codes(12, 7);
  screen.show(placement, codes);
  const std::uint64_t before = cell_checksum(screen.pixels(), placement);
  for (std::size_t i = 0; i < codes.size(); ++i) {
    auto other = codes;
    other[i] = 8;
    screen.show(placement, other);
    EXPECT_NE(cell_checksum(screen.pixels(), placement), before) << i;
  }
  screen.show(placement, codes);
  EXPECT_EQ(cell_checksum(screen.pixels(), placement), before);
}

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

// The loop outside the product makes the same frames as the product's virtual rig.

// Same patterns, times and frame numbers give the same photographs, bit for bit, including noise.
TEST(LoopLight, makes_the_frames_of_the_virtual_rig) {
  for (const std::string uri :
       {"sim:vgroove-textured?size=20x24", "sim:gummy?size=17x13&seed=4&black=0.01",
        "sim:mirror?size=24x20&flare=0.1&misalign=0.5",
        "sim:vgroove-textured?size=16x20&fine=2&camera=48x60&turn=1.5&zoom=0.85&distortion=0.02"}) {
    const auto virtual_rig = open_virtual_rig(uri + "&exposures=4");  // planned, noise has other keys
    ASSERT_TRUE(virtual_rig.ok()) << virtual_rig.error().line();
    LoopedRig looped(uri);
    const auto rig = looped.open();
    ASSERT_TRUE(rig.ok()) << rig.error().line();
    std::vector<Pattern> patterns;
    for (std::uint64_t i = 0; i < 5; ++i) patterns.push_back(drawn_pattern((*rig)->grid(), i));
    const auto expected = (*virtual_rig)->measure(patterns);
    const auto seen = (*rig)->measure(patterns);
    ASSERT_TRUE(expected.ok() && seen.ok()) << uri;
    for (std::size_t i = 0; i < patterns.size(); ++i) {
      EXPECT_TRUE((*seen)[i].mean == (*expected)[i].mean) << uri << " " << i;
      EXPECT_TRUE((*seen)[i].variance == (*expected)[i].variance) << uri << " " << i;
    }
  }
}

// An exposure during a change of the picture sees both pictures, each for its time.
TEST(LoopLight, mixes_light_by_time) {
  const auto uri = *parse_scene_uri("sim:vgroove-textured?size=20x24&black=0");
  const auto bench = *sim::make_bench(uri);
  const sim::ImageFormation formation(uri, *bench.view);
  const Pattern a = drawn_pattern(uri.size, 1), b = drawn_pattern(uri.size, 2);
  Pattern mixed(uri.size);
  for (std::size_t i = 0; i < mixed.values().size(); ++i)
    mixed.values()[i] = 0.25F * a.values()[i] + 0.5F * b.values()[i];
  const sim::ImageFormation::Share shares[] = {{formation.light_of(a, 0), 0.25},
                                               {formation.light_of(b, 1), 0.5}};
  const auto seen = formation.during(shares);
  const auto expected = formation.light_of(mixed, 0);
  for (std::size_t i = 0; i < mixed.values().size(); ++i)  // sums of a few hundred terms below 1 in float
    EXPECT_NEAR(seen->values()[i], expected->values()[i], 1e-5) << i;
}

}  // namespace
}  // namespace symrig::bench_vm::screens_test
