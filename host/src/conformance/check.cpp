// SPDX-License-Identifier: Apache-2.0
#include "conformance/check.hpp"

#include "conformance/raw_session.hpp"
#include "symrig/board/internal/explain.hpp"

#include <fmt/format.h>

namespace symrig {

std::string_view name(CheckOutcome outcome) {
  switch (outcome) {
    case CheckOutcome::passed:
      return "pass";
    case CheckOutcome::failed:
      return "fail";
    case CheckOutcome::skipped:
      return "skip";
  }
  return "?";
}

}  // namespace symrig

namespace symrig::conformance {
namespace {

std::string code_text(std::uint32_t code) {
  if (code == kNoCode) return "no answer";
  return fmt::format("{} ({})", code, board::explain_code(code).name);
}

}  // namespace

Verdict failed(std::string detail) {
  return {CheckOutcome::failed, std::move(detail)};
}

Verdict skipped(std::string why) {
  return {CheckOutcome::skipped, std::move(why)};
}

Verdict same(std::string_view what, std::uint64_t expected, std::uint64_t got) {
  if (expected == got) return {};
  return failed(fmt::format("{}: expected {}, got {}", what, expected, got));
}

Verdict within(std::string_view what, std::uint64_t low, std::uint64_t high, std::uint64_t got) {
  if (low <= got && got <= high) return {};
  return failed(fmt::format("{}: expected {} to {}, got {}", what, low, high, got));
}

Verdict that(bool holds, std::string_view what) {
  if (holds) return {};
  return failed(fmt::format("not fulfilled: {}", what));
}

Verdict code_is(std::string_view what, std::uint32_t expected, std::uint32_t got) {
  if (expected == got) return {};
  return failed(fmt::format("{}: expected code {}, got {}", what, code_text(expected), code_text(got)));
}

}  // namespace symrig::conformance
