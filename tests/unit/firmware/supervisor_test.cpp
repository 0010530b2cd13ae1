// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/supervisor.hpp"

#include "symrig/firmware/guard.hpp"

#include <array>
#include <cctype>
#include <string_view>

#include <gtest/gtest.h>

namespace symrig::firmware::supervisor_test {
namespace {

// The whole table again, written from the prose of firmware/README.md, one letter a cell:
//   . refused   b safe c l a r d f = next state (boot SAFE Configured Loaded Armed Running Done Fault)
//   capital letter: outputs are forced to their safe levels on the way; B is SAFE with force.
// Columns: boot_done config_line config_final config_reset | begin chunk good bad | arm start complete cut |
//          abort host_lost fault clear_fault | manual_set reboot
constexpr std::array<std::string_view, kStates> kProse{
    /* boot       */ "S... .... .... 0oF. ..",
    /* safe       */ ".sCS .... .... SSF. .S",
    /* configured */ ".S.S cclc .... CCF. cC",
    /* loaded     */ ".S.S c... a... LLF. lL",
    /* armed      */ ".... .... .r.. LFF. ..",
    /* running    */ ".... .... ..dL LFF. ..",
    /* done       */ ".S.S c... a... LLF. lL",
    /* fault      */ ".... .... .... FFFS .F",
};

char letter(const Transition& to) {
  constexpr std::string_view kNames =
      "oscl"
      "ardf";
  if (!to.allowed) return '.';
  const char name = kNames[static_cast<std::size_t>(to.next)];
  if ((to.actions & action::force_safe) == 0) return name;
  return name == 'o' ? '0' : static_cast<char>(std::toupper(name));
}

TEST(Supervisor, every_cell_is_as_the_prose_says) {
  int cells = 0;
  for (unsigned state = 0; state < kStates; ++state) {
    unsigned condition = 0;
    for (const char expected : kProse[state]) {
      if (expected == ' ') continue;
      const Transition to = transition(static_cast<State>(state), static_cast<Condition>(condition));
      EXPECT_EQ(letter(to), expected) << "state " << state << ", condition " << condition;
      ++condition;
      ++cells;
    }
    EXPECT_EQ(condition, kConditions);
  }
  EXPECT_EQ(cells, 144);
}

template <class Check>
void for_each_cell(Check check) {
  for (unsigned state = 0; state < kStates; ++state)
    for (unsigned condition = 0; condition < kConditions; ++condition)
      check(static_cast<State>(state), static_cast<Condition>(condition),
            transition(static_cast<State>(state), static_cast<Condition>(condition)));
}

TEST(Supervisor, laws_of_safety_hold_in_every_cell) {
  for_each_cell([](State state, Condition condition, const Transition& to) {
    const bool forced = (to.actions & action::force_safe) != 0;
    // A fault is taken in every state, an abort too; both force the outputs, and a fault latches.
    if (condition == Condition::fault) {
      EXPECT_TRUE(to.allowed && forced && to.next == State::fault);
    }
    if (condition == Condition::abort) {
      EXPECT_TRUE(to.allowed && forced);
    }
    // Only clear_fault leaves FAULT, and only for SAFE, with nothing kept.
    if (state == State::fault && to.allowed && to.next != State::fault) {
      EXPECT_EQ(condition, Condition::clear_fault);
      EXPECT_EQ(to.next, State::safe);
      EXPECT_EQ(to.actions, action::force_safe | action::drop_program | action::drop_config);
    }
    // RUNNING is entered from ARMED by start alone, ARMED by arm alone.
    if (to.allowed && to.next == State::running) {
      EXPECT_TRUE(state == State::armed && condition == Condition::start);
    }
    if (to.allowed && to.next == State::armed) {
      EXPECT_EQ(condition, Condition::arm);
      EXPECT_TRUE(state == State::loaded || state == State::done);
    }
    // A host that is lost while outputs may move is a fault.
    if (condition == Condition::host_lost && (state == State::armed || state == State::running)) {
      EXPECT_EQ(to.next, State::fault);
    }
    // Nothing but a run's own end leaves RUNNING without forcing the outputs.
    if (state == State::running && to.allowed && condition != Condition::run_complete) {
      EXPECT_TRUE(forced);
    }
    // Whoever falls back below LOADED has lost the program.
    const bool had_program = state == State::loaded || state == State::done;
    if (had_program && to.allowed && (to.next == State::safe || to.next == State::configured)) {
      EXPECT_NE(to.actions & action::drop_program, 0);
    }
  });
}

TEST(Supervisor, every_state_can_be_reached_and_left) {
  std::array<bool, kStates> reached{};
  reached[static_cast<std::size_t>(State::boot)] = true;
  for (unsigned round = 0; round < kStates; ++round)
    for_each_cell([&](State state, Condition, const Transition& to) {
      if (reached[static_cast<std::size_t>(state)] && to.allowed)
        reached[static_cast<std::size_t>(to.next)] = true;
    });
  for (unsigned state = 0; state < kStates; ++state) EXPECT_TRUE(reached[state]) << state;
}

using protocol::Rule;

protocol::BoardConfig lamp_on_line(unsigned line, std::uint64_t max_on, std::uint64_t min_off,
                                   std::uint16_t duty, bool safe_level = false) {
  protocol::BoardConfig config;
  config.lines[line] = {true, true, 3, 1, safe_level, false, max_on, min_off, duty};
  return config;
}

TEST(Guard, trips_one_tick_after_max_on) {
  Guard guard;
  guard.configure(lamp_on_line(2, 100, 0, 0), 0, 0);
  Breach breach;
  EXPECT_EQ(guard.next_deadline(), hal::kNever);
  EXPECT_FALSE(guard.edge({1000, 2, true}, breach));
  EXPECT_EQ(guard.next_deadline(), 1101U);
  EXPECT_FALSE(guard.check(1100, breach));
  ASSERT_TRUE(guard.check(1101, breach));
  EXPECT_EQ(breach.rule, Rule::max_on);
  EXPECT_EQ(breach.line, 2);
  EXPECT_EQ(breach.tick, 1101U);
}

TEST(Guard, a_pulse_seen_late_is_still_judged) {
  Guard guard;
  guard.configure(lamp_on_line(0, 100, 0, 0), 0, 0);
  Breach breach;
  guard.edge({0, 0, true}, breach);
  EXPECT_TRUE(guard.edge({101, 0, false}, breach));
  EXPECT_EQ(breach.rule, Rule::max_on);
}

TEST(Guard, on_is_away_from_the_safe_level) {
  Guard guard;
  guard.configure(lamp_on_line(1, 100, 0, 0, true), 2, 0);
  Breach breach;
  EXPECT_FALSE(guard.edge({10, 1, false}, breach));
  EXPECT_EQ(guard.next_deadline(), 111U);
  EXPECT_FALSE(guard.edge({110, 1, true}, breach));
  EXPECT_EQ(guard.next_deadline(), hal::kNever);
}

TEST(Guard, rests_are_judged_when_the_line_comes_on_again) {
  Guard guard;
  guard.configure(lamp_on_line(0, 0, 50, 0), 0, 0);
  Breach breach;
  EXPECT_FALSE(guard.edge({5, 0, true}, breach));  // rested for ever before
  EXPECT_FALSE(guard.edge({10, 0, false}, breach));
  EXPECT_FALSE(guard.edge({60, 0, true}, breach));
  EXPECT_FALSE(guard.edge({70, 0, false}, breach));
  ASSERT_TRUE(guard.edge({119, 0, true}, breach));
  EXPECT_EQ(breach.rule, Rule::min_off);
}

TEST(Guard, duty_and_what_is_still_missing_of_a_rest) {
  Guard guard;
  guard.configure(lamp_on_line(0, 0, 0, 250), 0, 0);
  Breach breach;
  guard.edge({1000, 0, true}, breach);
  guard.edge({1100, 0, false}, breach);  // 100 on: 300 of rest
  hal::Tick needed = 0;
  EXPECT_EQ(guard.cooling_line(protocol::kOutputMask, 1399, needed), 0);
  EXPECT_EQ(needed, 1U);
  EXPECT_EQ(guard.cooling_line(protocol::kOutputMask, 1400, needed), -1);
  ASSERT_TRUE(guard.edge({1399, 0, true}, breach));
  EXPECT_EQ(breach.rule, Rule::duty);
}

TEST(Guard, a_new_configuration_does_not_make_a_hot_lamp_cold) {
  Guard guard;
  guard.configure(lamp_on_line(0, 0, 1000, 0), 0, 0);
  Breach breach;
  guard.edge({10, 0, true}, breach);
  guard.edge({20, 0, false}, breach);
  guard.configure(lamp_on_line(0, 0, 1000, 0), 0, 30);
  hal::Tick needed = 0;
  EXPECT_EQ(guard.cooling_line(protocol::kOutputMask, 30, needed), 0);
  EXPECT_TRUE(guard.edge({100, 0, true}, breach));
}

TEST(Guard, lines_without_limits_are_not_watched) {
  Guard guard;
  protocol::BoardConfig config;
  config.lines[0] = {true, true, 0, 0, false, false, 0, 0, 0};
  guard.configure(config, 0, 0);
  Breach breach;
  EXPECT_FALSE(guard.watching());
  EXPECT_FALSE(guard.edge({10, 0, true}, breach));
  EXPECT_FALSE(guard.edge({10, 31, true}, breach));
}

}  // namespace
}  // namespace symrig::firmware::supervisor_test
