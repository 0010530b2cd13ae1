// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/conformance/conformance.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace symrig::conformance {

class BoardUnderTest;

/// The result of a check or of one of its steps. Converts to true if passed.
struct Verdict {
  CheckOutcome outcome = CheckOutcome::passed;
  std::string detail = {};

  explicit operator bool() const { return outcome == CheckOutcome::passed; }
};

Verdict failed(std::string detail);
Verdict skipped(std::string why);
/// "what: expected E, got G" unless they are equal.
Verdict same(std::string_view what, std::uint64_t expected, std::uint64_t got);
/// "what: expected LOW to HIGH, got G" unless LOW <= G <= HIGH.
Verdict within(std::string_view what, std::uint64_t low, std::uint64_t high, std::uint64_t got);
/// "not fulfilled: WHAT" unless it holds.
Verdict that(bool holds, std::string_view what);
/// Fails unless a reply came with this code. what: the request.
Verdict code_is(std::string_view what, std::uint32_t expected, std::uint32_t got);

struct Check {
  std::string_view name;
  std::string_view what;
  Verdict (*run)(BoardUnderTest& board);
};

// One list for each group.
std::span<const Check> identity_checks();
std::span<const Check> wire_checks();
std::span<const Check> event_checks();
std::span<const Check> state_checks();
std::span<const Check> rule_checks();
std::span<const Check> program_checks();
std::span<const Check> upload_checks();
std::span<const Check> limit_checks();
std::span<const Check> interlock_checks();
std::span<const Check> host_loss_checks();
std::span<const Check> receipt_checks();
std::span<const Check> clock_checks();
std::span<const Check> jumper_checks();

}  // namespace symrig::conformance

/// `SYMRIG_MUST(same("steps", 3, done.steps));` ends the check with that verdict unless it passed.
#define SYMRIG_MUST(expression)                                \
  do {                                                         \
    if (auto verdict = (expression); !verdict) return verdict; \
  } while (false)
