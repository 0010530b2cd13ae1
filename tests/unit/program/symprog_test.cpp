// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/symprog.hpp"

#include "symrig/board/board_info.hpp"
#include "workshop.hpp"

namespace symrig::symprog_test {
namespace {

CompiledProgram example() {
  return test::compiled(
      "symrig = 1\n[rig]\nprojector = \"dlpc900\"\nkeep_alive = \"2 s\"\n"
      "[rig.lines.lamp_enable]\nrole = \"lamp\"\nmax_on = \"50 ms\"\nmin_off = \"1 ms\"\nmax_duty = "
      "0.9\nactive = \"low\"\n"
      "[rig.lines.vsync]\nrole = \"interlock\"\ntrip = \"low\"\n"
      "[program]\npatterns = 3\nbracket = [\"1 ms\", \"2 ms\"]\nlamp = \"lamp_enable\"\n");
}

TEST(Symprog, comes_back_as_it_was) {
  const CompiledProgram program = example();
  const auto bytes = symprog_bytes(program);
  EXPECT_TRUE(looks_like_symprog(bytes));
  const auto back = read_symprog(bytes);
  ASSERT_OK(back);
  EXPECT_EQ(symprog_bytes(*back), bytes);
  EXPECT_EQ(back->program.hash(), program.program.hash());
  EXPECT_EQ(*config_hash(*back), *config_hash(program));
  EXPECT_EQ(back->keep_alive, program.keep_alive);
  EXPECT_EQ(back->on_time, program.on_time);
  EXPECT_EQ(back->places, program.places);
  EXPECT_EQ(back->wiring.active_low, program.wiring.active_low);
  EXPECT_EQ(back->wiring.readout, program.wiring.readout);
  ASSERT_EQ(back->lines.size(), program.lines.size());
  for (std::size_t k = 0; k < program.lines.size(); ++k) {
    EXPECT_EQ(back->lines[k].line, program.lines[k].line);
    EXPECT_EQ(back->lines[k].max_on, program.lines[k].max_on);
    EXPECT_EQ(back->lines[k].max_duty, program.lines[k].max_duty);
    EXPECT_EQ(back->lines[k].trip_level, program.lines[k].trip_level);
  }
}

// Every byte is covered: one that is changed or missing is noticed.
TEST(Symprog, damage_is_noticed) {
  const auto bytes = symprog_bytes(example());
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    auto damaged = bytes;
    damaged[k] ^= 0x40U;
    const auto read = read_symprog(damaged);
    ASSERT_FALSE(read.ok()) << "byte " << k;
    EXPECT_EQ(read.error().code, ErrorCode::bad_format);
    EXPECT_FALSE(read_symprog(std::span(bytes).first(k)).ok());
  }
}

TEST(Symprog, another_kind_of_board_is_refused_by_name) {
  const CompiledProgram program = example();
  BoardInfo board = test::board();
  EXPECT_TRUE(check_board_fits(program, board).ok());
  board.rate = {12'000'000};
  EXPECT_NE(check_board_fits(program, board).error().what.find("12000000"), std::string::npos);
  board = test::board();
  std::swap(board.lines[0], board.lines[1]);
  EXPECT_NE(check_board_fits(program, board).error().what.find("projector_trigger"), std::string::npos);
}

TEST(BoardFile, comes_back_as_it_was) {
  const std::string text = board_file_text(test::board());
  const auto board = parse_board_file(text);
  ASSERT_OK(board);
  EXPECT_EQ(board_file_text(*board), text);
  EXPECT_FALSE(parse_board_file("{}").ok());
  EXPECT_FALSE(parse_board_file("not json").ok());
}

TEST(BoardFile, may_be_the_manifest_of_a_firmware) {
  const auto board = parse_board_file(
      R"({"board": "pico", "capabilities": {"tick_hz": 125000000, "min_dwell": 6, "max_dwell": 4294967295,
          "wait_latency": 5, "queue_segments": 1022, "refill_ticks": 400, "poll_ticks": 200000, "program_bytes": 128000},
          "lines": [{"line": 0, "name": "lamp_enable", "pin": "GPIO2", "output": true, "waits": [], "trips": false, "stamp_ticks": 250},
                    {"line": 1, "name": "vsync", "pin": "GPIO16", "output": false, "waits": ["rising", "falling"],
                     "trips": false, "stamp_ticks": 2}]})");
  ASSERT_OK(board);
  EXPECT_EQ(board->board, "pico");
  EXPECT_EQ(board->min_dwell, Ticks{6});
  EXPECT_EQ(board->program_bytes, 128'000U);
  EXPECT_EQ(board->loop_depth, 4U);
  EXPECT_EQ(board->lines.at(0).waits, 0);
  EXPECT_EQ(board->lines.at(1).waits, 3);
  EXPECT_EQ(board->lines.at(1).stamp_ticks, 2U);
}

}  // namespace
}  // namespace symrig::symprog_test
