// SPDX-License-Identifier: Apache-2.0
// What program files become: the records, written down by hand.
#include "symrig/program/compile.hpp"
#include "symrig/protocol/program.hpp"
#include "workshop.hpp"

#include <fmt/format.h>

namespace symrig::records_test {
namespace {

using protocol::Op;

/// "set 1 12500", "loop 8", "wait 3 6250000 abort", ...: one line a record.
std::string listing(const Program& program) {
  std::string text;
  const protocol::ProgramView view{{program.bytes().data(), program.bytes().size()}};
  for (std::uint32_t k = 0; k < view.size(); ++k) {
    const protocol::Record record = view[k];
    switch (static_cast<Op>(record.op)) {
      case Op::set_word:
        text += fmt::format("set {:05b} {}\n", record.arg, record.ticks);
        break;
      case Op::loop:
        text += fmt::format("loop {}\n", protocol::loop_rounds(record));
        break;
      case Op::end_loop:
        text += "end_loop\n";
        break;
      case Op::wait_edge:
        text += fmt::format("wait {} {}{}\n", record.arg & 31U, record.ticks,
                            (record.arg & 128U) != 0 ? " abort" : "");
        break;
      case Op::mark:
        text += fmt::format("mark {}\n", record.arg);
        break;
      case Op::end:
        text += fmt::format("end {:05b}\n", record.arg);
        break;
    }
  }
  return text;
}

std::string records_of(const char* text) {
  return listing(test::compiled(text).program);
}

TEST(Records, a_bracket) {
  EXPECT_EQ(records_of("symrig = 1\n[program]\npatterns = 8\nbracket = [\"100 us\", \"1.6 ms\"]\n"),
            "loop 8\n"
            "mark 0\n"
            "set 00001 12500\n"  // 100 us: the projector's pulse
            "set 00000 5\n"      // the board's shortest word before a wait
            "wait 3 6250000 abort\n"
            "set 00000 125000\n"  // 1 ms to settle
            "mark 1\n"
            "set 00010 12500\n"   // 100 us of exposure
            "set 00000 500000\n"  // 4 ms of readout
            "mark 2\n"
            "set 00010 200000\n"
            "set 00000 500000\n"
            "end_loop\n"
            "end 00000\n");
}

TEST(Records, bracket_outer_takes_all_patterns_at_one_exposure_first) {
  EXPECT_EQ(records_of("symrig = 1\n[program]\npatterns = 8\norder = \"bracket-outer\"\n"
                       "bracket = [\"100 us\", \"1.6 ms\"]\n"),
            "loop 8\nmark 0\nset 00001 12500\nset 00000 5\nwait 3 6250000 abort\nset 00000 125000\n"
            "mark 1\nset 00010 12500\nset 00000 500000\nend_loop\n"
            "loop 8\nmark 0\nset 00001 12500\nset 00000 5\nwait 3 6250000 abort\nset 00000 125000\n"
            "mark 2\nset 00010 200000\nset 00000 500000\nend_loop\n"
            "end 00000\n");
}

// 1 ms of exposure is 985.74 us of pulse (123217.5 ticks, halves up), low; 14.26 us are 1782.5 ticks.
TEST(Records, a_global_shutter_camera_is_pulsed_low_for_the_exposure_less_14_26_us) {
  EXPECT_EQ(
      records_of("symrig = 1\n[rig.camera]\nprofile = \"raspberry-pi-global-shutter\"\nreadout = \"17 ms\"\n"
                 "[program]\npatterns = 1\nbracket = [\"1 ms\"]\n"),
      "mark 0\n"
      "set 00011 12500\n"
      "set 00010 5\n"
      "wait 3 6250000 abort\n"
      "set 00010 125000\n"
      "mark 1\n"
      "set 00000 123218\n"
      "set 00010 2126783\n"  // until the exposure ends, and 17 ms of readout
      "end 00010\n");
}

TEST(Records, delays_shift_lines_against_each_other) {
  EXPECT_EQ(
      records_of(
          "symrig = 1\n[rig.lines.lamp_enable]\ndelay = \"80 ns\"\n[rig.lines.camera_trigger]\n"
          "[program]\nsteps = [\n"
          "{ set = \"lamp_enable\", to = \"on\" }, { pulse = \"projector_trigger\", width = \"1 us\" },\n"
          "{ set = \"lamp_enable\", to = \"off\" }, { hold = \"1 us\" }]\n"),
      "set 00001 10\n"
      "set 00101 115\n"
      "set 00100 10\n"
      "set 00000 115\n"
      "end 00000\n");
}

// A lamp line that is on when low begins and ends high.
TEST(Records, active_low_lines_are_high_when_off) {
  EXPECT_EQ(records_of("symrig = 1\n[rig.lines.lamp_enable]\nactive = \"low\"\n[program]\nsteps = [\n"
                       "{ hold = \"1 us\" }, { pulse = \"lamp_enable\", width = \"2 us\" }]\n"),
            "set 00100 125\nset 00000 250\nend 00100\n");
}

TEST(Records, the_first_pulse_of_each_sequence_is_longer) {
  const std::string text = records_of(
      "symrig = 1\n[program]\npatterns = 3\nbracket = [\"1 ms\"]\nrepeat = 7\n"
      "start_marker = { line = \"projector_trigger\", stretch = \"100 us\" }\n");
  EXPECT_EQ(text.substr(0, text.find("wait")), "loop 7\nmark 0\nset 00001 25000\nset 00000 5\n");
  EXPECT_NE(text.find("loop 2\nmark 0\nset 00001 12500\n"), std::string::npos) << text;
}

TEST(Records, startup_exposures_come_before_the_first_pattern) {
  const std::string text = records_of(
      "symrig = 1\n[program]\npatterns = 1\nbracket = [\"1 ms\"]\nstartup = { pulses = 3, exposure = \"2 "
      "ms\" }\n");
  EXPECT_EQ(text.rfind("loop 3\nmark 268435455\nset 00010 250000\nset 00000 500000\nend_loop\nmark 0\n", 0),
            0U)
      << text;
}

TEST(Records, a_triggered_projector_is_given_its_delay) {
  EXPECT_EQ(
      records_of(
          "symrig = 1\n[rig]\nprojector = \"dlpc900\"\n[program]\npatterns = 1\nbracket = [\"1 ms\"]\n"),
      "mark 0\n"
      "set 00001 2500\n"   // 20 us of trigger
      "set 00000 11875\n"  // 105 us after its rise, and 10 us to settle
      "mark 1\n"
      "set 00010 125000\n"
      "set 00000 500000\n"
      "end 00000\n");
}

// An 8-bit pattern is itself only as a whole: the exposure begins before the trigger and ends after the
// pattern.
TEST(Records, triggered_patterns_made_up_in_time_are_exposed_all_around) {
  EXPECT_EQ(records_of("symrig = 1\n[rig]\nprojector = \"dlpc900\"\n[program]\npatterns = 1\nbits = 8\n"
                       "bracket = [\"5 ms\"]\n"),
            "mark 0\n"
            "mark 1\n"
            "set 00010 5\n"
            "set 00011 2500\n"
            "set 00010 622495\n"
            "set 00000 500000\n"
            "end 00000\n");
}

TEST(Records, a_timed_camera_gets_its_trigger_pulse_and_time_to_expose) {
  EXPECT_EQ(
      records_of(
          "symrig = 1\n[rig]\nprojector = \"dlpc900\"\n[rig.camera]\nprofile = \"generic-strobed\"\n"
          "exposure = \"timed\"\ntrigger_pulse = \"10 us\"\n[program]\npatterns = 1\nbracket = [\"1 ms\"]\n"
          "start_marker = { line = \"camera_trigger\", stretch = \"5 us\" }\n"),
      "mark 0\n"
      "set 00001 2500\n"
      "set 00000 11875\n"
      "mark 1\n"
      "set 00010 1875\n"    // 10 us, and 5 us that mark the start
      "set 00000 623125\n"  // the rest of 1 ms, and 4 ms of readout
      "end 00000\n");
}

TEST(Records, loops_of_2_to_the_32_rounds) {
  EXPECT_EQ(
      records_of("symrig = 1\n[program]\nsteps = [{ loop = 4294967296, steps = [{ hold = \"8 us\" }] }]\n"),
      "loop 4294967296\nset 00000 1000\nend_loop\nend 00000\n");
}

TEST(Records, eight_patterns_of_five_exposures_take_less_than_100) {
  for (const char* order : {"pattern-outer", "bracket-outer"}) {
    const auto program =
        test::compiled(fmt::format("symrig = 1\n[program]\npatterns = 8\norder = \"{}\"\n"
                                   "bracket = {{ shortest = \"100 us\", ratio = 4, count = 5 }}\n",
                                   order));
    EXPECT_LT(program.program.records(), 100U);
    EXPECT_EQ(program.exposures, 40U);
  }
}

// With 800 photographs the program is no longer than with one.
TEST(Records, photographs_that_are_alike_are_one_loop) {
  const auto of = [](int patterns) {
    return test::compiled(
        fmt::format("symrig = 1\n[program]\npatterns = {}\n"
                    "bracket = [\"100 us\", \"800 us\", \"6.4 ms\", \"51.2 ms\"]\n",
                    patterns));
  };
  EXPECT_EQ(of(800).program.records(), of(2).program.records());
  EXPECT_EQ(of(800).exposures, 3200U);
}

// A capture's photographs are a scan like any other.
TEST(Records, of_brackets_are_those_of_a_scan) {
  const std::vector<std::vector<Nanoseconds>> brackets(8, {Nanoseconds{100'000}, Nanoseconds{1'600'000}});
  const auto captured = compile_brackets(default_rig_setup(), test::board(), brackets);
  ASSERT_OK(captured);
  EXPECT_EQ(listing(captured->program),
            records_of("symrig = 1\n[program]\npatterns = 8\nbracket = [\"100 us\", \"1.6 ms\"]\n"));
}

TEST(Records, know_the_line_of_the_file_that_they_come_from) {
  const auto program = test::compiled(
      "symrig = 1\n[program]\nsteps = [\n  { hold = \"1 us\" },\n  { loop = 2, steps = [\n    { mark = 1 },\n"
      "    { pulse = \"lamp_enable\", width = \"1 us\" },\n    { hold = \"1 us\" },\n  ] },\n]\n");
  EXPECT_EQ(listing(program.program),
            "set 00000 125\nloop 2\nmark 1\nset 00100 125\nset 00000 125\nend_loop\nend 00000\n");
  EXPECT_EQ(program.places, (std::vector<int>{4, 5, 6, 7, 7, 5, 5}));
}

}  // namespace
}  // namespace symrig::records_test
