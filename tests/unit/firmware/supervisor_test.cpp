// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/supervisor.hpp"

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

}  // namespace
}  // namespace symrig::firmware::supervisor_test
