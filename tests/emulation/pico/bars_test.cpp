// SPDX-License-Identifier: Apache-2.0
// The Pico's promises, measured on the image that users flash. Time is the emulated board's: 8 ns a cycle.
#include "emulated_pico.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::test::bars_test {
namespace {

using namespace std::chrono_literals;

constexpr std::array<const char*, 12> kOutputs{"projector_trigger",
                                               "camera_trigger",
                                               "lamp_enable",
                                               "camera_trigger_b",
                                               "laser_enable",
                                               "aux0",
                                               "aux1",
                                               "aux2",
                                               "aux3",
                                               "aux4",
                                               "aux5",
                                               "aux6"};

Ticks ticks_of(std::uint64_t count) {
  return Ticks{count};
}

/// Edges of the outputs after `cycle` as words: (cycle, levels).
struct Word {
  std::uint64_t cycle;
  std::uint32_t levels;
};

std::vector<Word> words_of(const std::vector<PinEdge>& edges, std::uint32_t levels) {
  std::vector<Word> words;
  for (const PinEdge& edge : edges) {
    if (edge.gpio >= kOutputs.size()) continue;
    const std::uint32_t bit = 1U << edge.gpio;
    levels = edge.level ? levels | bit : levels & ~bit;
    if (!words.empty() && words.back().cycle == edge.cycle) {
      words.back().levels = levels;
    } else {
      words.push_back({edge.cycle, levels});
    }
  }
  return words;
}

/// A body of words that toggles all outputs at odd times; `shortest` ticks at least.
struct Body {
  std::vector<std::uint32_t> levels;
  std::vector<std::uint32_t> ticks;
};

Body toggling_body(std::uint32_t shortest) {
  Body body;
  std::uint32_t word = 0x5A5;
  for (std::uint32_t k = 0; k < 16; ++k) {
    word = (word * 1103515245U + 12345U) & 0xFFFFFFU;
    body.levels.push_back((body.levels.empty() ? 0 : body.levels.back()) ^ (0xFFFU & (word >> 7U)) ^ 1U);
    body.ticks.push_back(shortest + word % 37U);
  }
  return body;
}

void add(ProgramBuilder& program, const Body& body) {
  for (std::size_t k = 0; k < body.levels.size(); ++k) {
    for (std::size_t line = 0; line < kOutputs.size(); ++line)
      program.set(kOutputs[line], ((body.levels[k] >> line) & 1U) != 0);
    program.hold(ticks_of(body.ticks[k]));
  }
}

void all_low(ProgramBuilder& program) {
  for (const char* line : kOutputs) program.set(line, false);
}

TEST(EmulatedPico, says_who_it_is) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  Board board = pico.connect();
  const BoardInfo& info = board.info();
  EXPECT_EQ(info.board, "pico");
  EXPECT_EQ(info.rate.hz, 125'000'000U);
  EXPECT_GE(info.program_bytes, 16'000U * 8U);
  EXPECT_LE(info.rate.nanoseconds(info.min_dwell), 64ns);
  const auto status = board.status();
  ASSERT_OK(status);
  EXPECT_EQ(status->state, BoardState::safe);
}

TEST(EmulatedPico, a_hundred_thousand_edges_are_exact_while_usb_is_busy) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  Board board = pico.connect();
  ASSERT_OK(board.configure({}));
  const Body body = toggling_body(board.info().refill_ticks + 60);
  constexpr std::uint32_t kRounds = 1200;
  ProgramBuilder builder(board.info());
  builder.loop(kRounds);
  add(builder, body);
  all_low(builder);
  builder.hold(ticks_of(1000)).end_loop();
  const auto program = builder.end();
  ASSERT_OK(program);
  ASSERT_OK(board.upload(*program));
  ASSERT_OK(board.arm());
  pico.edges();
  ASSERT_OK(board.start());
  int asked = 0;
  for (BoardState state = BoardState::running; state == BoardState::running; ++asked) {
    const auto status = board.status();
    ASSERT_OK(status);
    state = status->state;
    ASSERT_NE(state, BoardState::fault) << status->fault->name;
  }
  const std::vector<Word> words = words_of(pico.edges(), 0);
  std::size_t edges = 0;
  std::size_t next = 0;
  std::uint64_t due = words.at(0).cycle;
  std::uint32_t before = 0;
  for (std::uint32_t round = 0; round < kRounds; ++round)
    for (std::size_t k = 0; k <= body.levels.size(); ++k) {
      const std::uint32_t levels = k < body.levels.size() ? body.levels[k] : 0;
      if (levels != before) {
        ASSERT_LT(next, words.size());
        ASSERT_EQ(words[next].cycle, due) << "round " << round << ", word " << k;
        ASSERT_EQ(words[next].levels, levels) << "round " << round << ", word " << k;
        edges += static_cast<std::size_t>(std::popcount(levels ^ before));
        ++next;
      }
      before = levels;
      due += k < body.ticks.size() ? body.ticks[k] : 1000;
    }
  EXPECT_EQ(next, words.size());
  EXPECT_GE(edges, 100'000U);
  EXPECT_GT(asked, 20);
  std::printf("edges %zu, jitter 0 cycles, status requests meanwhile %d\n", edges, asked);
}

TEST(EmulatedPico, the_shortest_level_is_exact) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  Board board = pico.connect();
  ASSERT_OK(board.configure({}));
  const Ticks shortest = board.info().min_dwell;
  ProgramBuilder builder(board.info());
  builder.loop(40).set("aux0", true).hold(shortest).set("aux0", false).hold(shortest).end_loop();
  const auto program = builder.end();
  ASSERT_OK(program);
  pico.edges();
  ASSERT_OK(board.run(*program, 1s));
  const auto edges = of_pin(pico.edges(), gpio_of(board.info(), "aux0"));
  ASSERT_EQ(edges.size(), 80U);
  for (std::size_t k = 1; k < edges.size(); ++k)
    EXPECT_EQ(edges[k].cycle - edges[k - 1].cycle, shortest.count);
  std::printf("shortest level %lld ns\n",
              static_cast<long long>(board.info().rate.nanoseconds(shortest).count()));
}

TEST(EmulatedPico, from_vsync_to_camera_takes_the_same_time_in_a_thousand_frames) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  Board board = pico.connect();
  ASSERT_OK(board.configure({}));
  ProgramBuilder builder(board.info());
  builder.loop(1000)
      .wait_edge("vsync", EdgeKind::rising, 100ms, OnTimeout::abort)
      .pulse("camera_trigger", 10us)
      .hold(50us)
      .end_loop();
  const auto program = builder.end();
  ASSERT_OK(program);
  ASSERT_OK(board.upload(*program));
  ASSERT_OK(board.arm());
  const unsigned vsync = gpio_of(board.info(), "vsync");
  ASSERT_OK(pico.bench().pulse(static_cast<std::uint8_t>(vsync), 200'007ns, 5us));
  pico.edges();
  ASSERT_OK(board.start());
  const auto receipt = board.wait(10s);
  ASSERT_OK(receipt);
  EXPECT_EQ(receipt->end, RunEnd::completed);
  const auto edges = pico.edges();
  std::vector<std::uint64_t> delays;
  std::uint64_t rose = 0;
  for (const PinEdge& edge : edges) {
    if (edge.gpio == vsync && edge.level) rose = edge.cycle;
    if (edge.gpio == gpio_of(board.info(), "camera_trigger") && edge.level)
      delays.push_back(edge.cycle - rose);
  }
  ASSERT_EQ(delays.size(), 1000U);
  const auto [least, most] = std::minmax_element(delays.begin(), delays.end());
  EXPECT_LE(*most - *least, 1U);
  EXPECT_EQ(*least, board.info().wait_latency.count);
  std::printf("from vsync to camera %llu..%llu cycles\n", static_cast<unsigned long long>(*least),
              static_cast<unsigned long long>(*most));
}

TEST(EmulatedPico, stamps_are_within_two_cycles_of_the_edges) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  Board board = pico.connect();
  const std::vector<LineConfig> lines{{.line = "camera_strobe", .capture = true}};
  ASSERT_OK(board.configure(lines));
  const unsigned from = gpio_of(board.info(), "aux0");
  const unsigned to = gpio_of(board.info(), "camera_strobe");
  ASSERT_OK(pico.bench().jumper(static_cast<std::uint8_t>(from), static_cast<std::uint8_t>(to)));
  ProgramBuilder builder(board.info());
  std::vector<std::uint64_t> planned;
  std::uint64_t tick = 0;
  for (std::uint64_t k = 0; k < 150; ++k) {
    const std::uint64_t on = 100 + 37 * k;
    builder.set("aux0", true).hold(ticks_of(on)).set("aux0", false).hold(ticks_of(12'000 + k));
    planned.push_back(tick);
    planned.push_back(tick + on);
    tick += on + 12'000 + k;
  }
  const auto program = builder.end();
  ASSERT_OK(program);
  const auto receipt = board.run(*program, 2s);
  ASSERT_OK(receipt);
  ASSERT_EQ(receipt->edges.size(), planned.size());
  std::int64_t least = 1000;
  std::int64_t most = -1000;
  for (std::size_t k = 0; k < planned.size(); ++k) {
    const auto error = static_cast<std::int64_t>(receipt->edges[k].tick.count) -
                       static_cast<std::int64_t>(receipt->started.count + planned[k]);
    least = std::min(least, error);
    most = std::max(most, error);
  }
  EXPECT_GE(least, -2);
  EXPECT_LE(most, 2);
  std::printf("stamp error %lld..%lld cycles\n", static_cast<long long>(least), static_cast<long long>(most));
}

/// A board with a lamp line that is on in a long program, running.
struct Burning {
  EmulatedPico pico;
  Board board;
  std::uint32_t levels = 0;  // of the outputs, as far as edges were looked at

  explicit Burning(Nanoseconds ttl, bool with_interlock = false) : board(pico.connect({.keep_alive = ttl})) {
    std::vector<LineConfig> lines{{.line = "lamp_enable", .hazard = Hazard::lamp}};
    if (with_interlock) lines.push_back({.line = "interlock", .trip_level = false});
    if (with_interlock) drive_interlock(true);
    start(lines);
  }
  void drive_interlock(bool level) {
    const auto pin = static_cast<std::uint8_t>(gpio_of(board.info(), "interlock"));
    const auto driven = pico.bench().drive(pin, level);
    EXPECT_TRUE(driven.ok());
  }
  void start(const std::vector<LineConfig>& lines) {
    ASSERT_OK(board.configure(lines));
    ProgramBuilder builder(board.info());
    builder.set("lamp_enable", true).hold(100us).loop(1'000'000).set("aux1", true).hold(100us);
    const auto program = builder.set("aux1", false).hold(100us).end_loop().set("lamp_enable", false).end();
    ASSERT_OK(program);
    ASSERT_OK(board.upload(*program));
    ASSERT_OK(board.arm());
    ASSERT_OK(board.start());
    pico.pass(1ms);
    look();
    ASSERT_NE(levels & (1U << gpio_of(board.info(), "lamp_enable")), 0U);
  }
  /// The outputs' words since the last look.
  std::vector<Word> look() {
    std::vector<Word> words = words_of(pico.edges(), levels);
    if (!words.empty()) levels = words.back().levels;
    return words;
  }
  /// When the outputs last changed, all of them low from then on.
  std::uint64_t safe_since() {
    const std::vector<Word> words = look();
    EXPECT_FALSE(words.empty());
    EXPECT_EQ(levels, 0U);
    return words.empty() ? 0 : words.back().cycle;
  }
};

TEST(EmulatedPico, an_interlock_makes_safe_within_ten_microseconds) {
  NEEDS_EMULATION();
  Burning burning(1s, true);
  const std::uint64_t opened = burning.pico.cycle();
  burning.drive_interlock(false);
  burning.pico.pass(5ms);
  const std::uint64_t safe = burning.safe_since();
  EXPECT_LE(safe - opened, 1250U);
  std::printf("interlock to safe %.2f us\n", static_cast<double>(safe - opened) * 0.008);
  const auto status = burning.board.status();
  ASSERT_OK(status);
  ASSERT_TRUE(status->fault);
  EXPECT_EQ(status->fault->name, "interlock");
}

TEST(EmulatedPico, an_abort_makes_safe_within_fifty_microseconds_of_its_last_byte) {
  NEEDS_EMULATION();
  std::uint64_t worst = 0;
  for (int k = 0; k < 5; ++k) {
    Burning burning(1s);
    burning.pico.pass(Nanoseconds{37'000 * k});
    const std::uint64_t asked = burning.pico.cycle();
    ASSERT_OK(burning.board.abort());
    const std::uint64_t safe = burning.safe_since();
    worst = std::max(worst, safe - asked);
  }
  std::printf("abort asked to safe, USB included, at worst %.2f us\n", static_cast<double>(worst) * 0.008);
  EXPECT_LE(worst, 50'000U / 8U);
}

TEST(EmulatedPico, an_underrun_makes_safe_within_a_microsecond) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  Board board = pico.connect();
  ASSERT_OK(board.configure({}));
  const std::uint64_t word = 2 * std::uint64_t{board.info().refill_ticks};
  ProgramBuilder builder(board.info());
  builder.loop(1'000'000)
      .set("aux0", true)
      .hold(ticks_of(word))
      .set("aux1", true)
      .set("aux0", false)
      .hold(ticks_of(word));
  const auto program = builder.set("aux1", false).end_loop().end();
  ASSERT_OK(program);
  ASSERT_OK(board.upload(*program));
  ASSERT_OK(board.arm());
  ASSERT_OK(board.start());
  pico.pass(1ms);
  pico.edges();
  ASSERT_OK(pico.bench().stall(50ms));  // the queue lasts for a few milliseconds
  const std::vector<Word> words = words_of(pico.edges(), 0);
  ASSERT_GT(words.size(), 10U);
  EXPECT_EQ(words.back().levels, 0U);
  const std::uint64_t last = words.back().cycle - words[words.size() - 2].cycle;
  EXPECT_GE(last, word);
  EXPECT_LE(last - word, 125U);
  std::printf("underrun to safe %.3f us\n", static_cast<double>(last - word) * 0.008);
  pico.pass(2ms);
  const auto status = board.status();
  ASSERT_OK(status);
  ASSERT_TRUE(status->fault);
  EXPECT_EQ(status->fault->name, "underrun");
}

TEST(EmulatedPico, a_silent_host_makes_safe_ten_milliseconds_after_the_keep_alive_at_the_latest) {
  NEEDS_EMULATION();
  Burning burning(100ms);
  ASSERT_OK(burning.board.keep_alive(100ms));
  const std::uint64_t last = burning.pico.cycle();
  burning.pico.pass(130ms);
  const std::uint64_t safe = burning.safe_since();
  EXPECT_LE(safe - last, 110'000'000U / 8U);
  std::printf("keep-alive of 100 ms to safe %.3f ms\n", static_cast<double>(safe - last) * 8e-6);
}

TEST(EmulatedPico, a_pulled_cable_makes_safe_within_ten_milliseconds) {
  NEEDS_EMULATION();
  Burning burning(5s);
  const std::uint64_t pulled = burning.pico.cycle();
  ASSERT_OK(burning.pico.bench().cable(false));
  ASSERT_OK(burning.pico.bench().stall(1us));
  const std::uint64_t safe = burning.safe_since();
  EXPECT_LE(safe - pulled, 10'000'000U / 8U);
  std::printf("cable to safe %.3f ms\n", static_cast<double>(safe - pulled) * 8e-6);
}

TEST(EmulatedPico, firmware_that_stands_still_is_reset_with_outputs_low) {
  NEEDS_EMULATION();
  Burning burning(60s);
  const std::uint64_t stuck = burning.pico.cycle();
  ASSERT_OK(burning.pico.bench().stall(700ms));
  const std::uint64_t safe = burning.safe_since();
  EXPECT_LE(safe - stuck, 500'000'000U / 8U);
  burning.pico.pass(1s);
  Board again = burning.pico.connect();
  const auto status = again.status();
  ASSERT_OK(status);
  EXPECT_EQ(status->state, BoardState::safe);
  EXPECT_EQ(status->reset_cause, ResetCause::watchdog);
  ASSERT_TRUE(status->reset_fault);
}

TEST(EmulatedPico, sixteen_thousand_records_are_there_within_a_second) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  Board board = pico.connect();
  ASSERT_OK(board.configure({}));
  ProgramBuilder builder(board.info());
  for (std::uint32_t k = 0; k < 15'999; ++k) builder.set("aux0", k % 2 == 0).hold(ticks_of(2000 + k));
  const auto program = builder.end();
  ASSERT_OK(program);
  ASSERT_EQ(program->records(), 16'000U);
  const Nanoseconds before = *pico.bench().now();
  ASSERT_OK(board.upload(*program));
  const Nanoseconds took = *pico.bench().now() - before;
  EXPECT_LE(took, 1s);
  std::printf("16000 records uploaded and committed in %.3f s\n", static_cast<double>(took.count()) * 1e-9);
}

TEST(EmulatedPico, keeps_its_configuration_over_power_off) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  {
    Board board = pico.connect();
    const std::vector<LineConfig> lines{{.line = "aux3", .safe_level = true}};
    ASSERT_OK(board.configure(lines));
    ASSERT_OK(board.store_config("left rig"));
  }
  ASSERT_OK(pico.bench().power_cycle());
  Board board = pico.connect();
  EXPECT_EQ(board.info().label, "left rig");
  const auto status = board.status();
  ASSERT_OK(status);
  EXPECT_NE(status->stored_config, 0U);
  EXPECT_EQ((status->levels >> 8U) & 1U, 1U);
}

}  // namespace
}  // namespace symrig::test::bars_test
