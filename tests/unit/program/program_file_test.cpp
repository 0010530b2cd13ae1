// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/time.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/program/compile.hpp"
#include "workshop.hpp"

#include <utility>
#include <vector>

namespace symrig::program_file_test {
namespace {

using namespace std::chrono_literals;

TEST(Duration, is_exact_to_the_nanosecond_halves_up) {
  const std::vector<std::pair<const char*, Nanoseconds>> good{
      {"14.26 us", 14'260ns}, {"1.5ms", 1'500'000ns},          {"2 s", 2s},
      {"0 ns", 0ns},          {"16.666667 ms", 16'666'667ns},  {"0.4 ns", 0ns},
      {"0.5 ns", 1ns},        {"1.0000004 ms", 1'000'000ns},   {"1.0000005 ms", 1'000'001ns},
      {"3 µs", 3us},          {"9000000000 s", 9'000'000'000s}};
  for (const auto& [text, value] : good) EXPECT_EQ(base::parse_duration(text), value) << text;
  for (const char* text : {"", "ms", "1", "1 m", "-1 ms", "1. ms", ".5 ms", "1e3 ms", "1 ms ", " 1 ms",
                           "1,5 ms", "10000000000 s", "99999999999999999999 ns"})
    EXPECT_FALSE(base::parse_duration(text).has_value()) << text;
}

constexpr const char* kScan = "symrig = 1\n[program]\npatterns = 2\nbracket = [\"1 ms\"]\n";

TEST(ProgramFile, a_short_one_has_defaults_for_everything_else) {
  const ProgramFile file = test::parse(kScan);
  ASSERT_TRUE(file.scan.has_value());
  EXPECT_EQ(file.scan->pattern_count(), 2U);
  EXPECT_EQ(file.scan->bracket, std::vector<Nanoseconds>{1ms});
  EXPECT_EQ(file.rig.camera.name, "generic-strobed");
  EXPECT_EQ(file.rig.projector.name, "hdmi-60");
  ASSERT_NE(file.rig.with_role(RigRole::camera), nullptr);
  EXPECT_EQ(file.rig.with_role(RigRole::camera)->config.line, "camera_trigger");
  EXPECT_EQ(file.rig.keep_alive, 1s);
}

TEST(ProgramFile, lines_have_polarity_delay_and_limits) {
  const ProgramFile file = test::parse(
      "symrig = 1\n[rig.lines.lamp_enable]\nrole = \"lamp\"\nactive = \"low\"\ndelay = \"40 ns\"\n"
      "max_on = \"10 ms\"\nmin_off = \"1 ms\"\nmax_duty = 0.5\ncapture = false\n"
      "[rig.lines.vsync]\nrole = \"interlock\"\ntrip = \"low\"\n"
      "[program]\nsteps = [{ hold = \"1 ms\" }]\n");
  const RigLine* lamp = file.rig.find("lamp_enable");
  ASSERT_NE(lamp, nullptr);
  EXPECT_TRUE(lamp->active_low);
  EXPECT_TRUE(lamp->config.safe_level);  // off is high
  EXPECT_EQ(lamp->delay, 40ns);
  EXPECT_EQ(lamp->config.max_on, 10ms);
  EXPECT_EQ(lamp->config.min_off, 1ms);
  EXPECT_EQ(lamp->config.max_duty, 0.5);
  EXPECT_EQ(lamp->config.hazard, Hazard::lamp);
  EXPECT_EQ(lamp->place, 2);
  ASSERT_TRUE(file.rig.find("vsync")->config.trip_level.has_value());
  EXPECT_FALSE(*file.rig.find("vsync")->config.trip_level);
}

TEST(ProgramFile, a_series_of_exposures) {
  const ProgramFile file = test::parse(
      "symrig = 1\n[program]\npatterns = 1\nbracket = { shortest = \"100 us\", ratio = 2.5, count = 4 }\n");
  EXPECT_EQ(file.scan->bracket, (std::vector<Nanoseconds>{100us, 250us, 625us, 1562500ns}));
}

TEST(ProgramFile, loops_take_2_to_the_32_rounds_and_no_more) {
  const auto text = [](const std::string& rounds) {
    return "symrig = 1\n[program]\nsteps = [{ loop = " + rounds + ", steps = [{ hold = \"1 ms\" }] }]\n";
  };
  EXPECT_EQ(test::parse(text("4294967296")).steps.at(0).count, kMaxRounds);
  EXPECT_FALSE(parse_program_file(text("4294967297"), "scan.toml", "").ok());
  EXPECT_FALSE(parse_program_file(text("0"), "scan.toml", "").ok());
}

/// What is wrong, at which line, and words of the message.
struct Fault {
  const char* text;
  int line;
  std::vector<const char*> words;
};

TEST(ProgramFile, faults_name_the_line_the_key_and_what_is_legal) {
  const std::vector<Fault> faults{
      {"symrig = 1\n[program]\npatterns = 2\n", 2, {"program.bracket is missing", "shortest"}},
      {"symrig = 1\n", 1, {"program is missing"}},
      {"symrig = 1\n[program]\npatterns = 2\nbracket = [\"1 ms\"]\nsettel = \"1 ms\"\n",
       5,
       {"no key program.settel", "settle"}},
      {"symrig = 1\n[rig]\ncamera = \"kodak\"\n[program]\npatterns = 2\nbracket = [\"1 ms\"]\n",
       3,
       {"rig.camera", "kodak", "basler-trigger-width"}},
      {"symrig = 1\n[program]\npatterns = 0\nbracket = [\"1 ms\"]\n", 3, {"program.patterns", "1 to"}},
      {"symrig = 1\n[program]\npatterns = 2\nbracket = [\"1 ms\", 3]\n", 4, {"not a duration"}},
      {"symrig = 1\n[program]\npatterns = 2\nbracket = { shortest = \"1 ms\", ratio = 1, count = 2 }\n",
       4,
       {"ratio", "above 1"}},
      {"symrig = 1\n[program]\npatterns = 2\nbracket = [\"1 ms\"]\norder = \"both\"\n",
       5,
       {R"("pattern-outer", "bracket-outer")"}},
      {"symrig = 1\n[program]\nsteps = [\n  { hold = \"1 ms\", mark = 3 },\n]\n", 4, {"more than one thing"}},
      {"symrig = 1\n[program]\nsteps = [\n  { wait = \"vsync\" },\n]\n", 4, {"timeout is missing"}},
      {"symrig = 1\n[program]\nsteps = [{ hold = \"1 ms\" }]\npatterns = 2\n",
       3,
       {"either steps, or patterns"}},
      {"symrig = 1\n[rig.lines.vsync]\nrole = \"interlock\"\n[program]\nsteps = [{ hold = \"1 ms\" }]\n",
       2,
       {"trip is missing"}},
      {"symrig = 1\n[rig.lines.lamp_enable]\nmax_duty = 2\n[program]\nsteps = [{ hold = \"1 ms\" }]\n",
       3,
       {"max_duty", "0.001 to 1"}},
      {"symrig = 1\n[program\n", 2, {"TOML"}}};
  for (const Fault& fault : faults) {
    const auto file = parse_program_file(fault.text, "scan.toml", "");
    ASSERT_FALSE(file.ok()) << fault.text;
    EXPECT_EQ(file.error().code, ErrorCode::bad_format);
    const std::string line = file.error().line();
    EXPECT_EQ(line.rfind("scan.toml:" + std::to_string(fault.line) + ":", 0), 0U) << line;
    for (const char* word : fault.words) EXPECT_NE(line.find(word), std::string::npos) << line;
  }
}

// Nothing that a file may hold makes the reader fall: every prefix of a real one, and every one-byte change
// of it.
TEST(ProgramFile, damaged_files_are_read_or_refused) {
  const std::string text =
      "symrig = 1\n[rig.camera]\nprofile = \"generic-strobed\"\n[rig.lines.lamp_enable]\nrole = \"lamp\"\n"
      "[program]\npatterns = [{ count = 3, bits = 8 }]\nbracket = { shortest = \"1 ms\", ratio = 2, count = "
      "3 }\n"
      "start_marker = { line = \"projector_trigger\", stretch = \"1 us\" }\n";
  std::size_t refused = 0;
  for (std::size_t k = 0; k <= text.size(); ++k)
    refused += parse_program_file(text.substr(0, k), "scan.toml", "").ok() ? 0U : 1U;
  for (std::size_t k = 0; k < text.size(); ++k) {
    std::string changed = text;
    changed[k] = static_cast<char>(changed[k] ^ 0x15);
    refused += parse_program_file(changed, "scan.toml", "").ok() ? 0U : 1U;
  }
  EXPECT_GT(refused, text.size());
}

}  // namespace
}  // namespace symrig::program_file_test

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
