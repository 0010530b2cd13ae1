// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/jumper.hpp"
#include "symrig/board/link.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

enum class CheckOutcome : std::uint8_t { passed, failed, skipped };
std::string_view name(CheckOutcome outcome);

/// One thing that every board must do, as protocol/PROTOCOL.md says.
struct CheckInfo {
  std::string_view name;  ///< "wire.corrupted"
  std::string_view what;  ///< in a few words
};

struct CheckResult {
  std::string name;
  CheckOutcome outcome = CheckOutcome::passed;
  std::string detail;  ///< failed: what was expected and what came; skipped: why
};

struct ConformanceOptions {
  std::string filter;            ///< regular expression; only checks whose name it finds. Empty: all
  std::optional<Jumper> jumper;  ///< without one, checks that need it are skipped
  std::function<void(const CheckResult&)> on_result;  ///< called after each check
  std::function<bool()> stop;  ///< asked before each check: true = end here, with the board safe
};

struct ConformanceReport {
  std::string board, firmware_version, unique_id;
  std::vector<CheckResult> results;

  std::size_t count(CheckOutcome outcome) const;
  /// Nothing failed, and something was looked at.
  bool passed() const;
};

/// All checks, in the order in which they are made.
std::vector<CheckInfo> conformance_checks();

/// Makes the checks against whatever board is at the other end. Needs nothing but the link, and runs on the
/// link's clock: in virtual time as on a cable. Outputs move: nothing that lights, heats or shoots may be
/// wired to them. The board is never left armed; at the end it is safe and has forgotten its configuration
/// (what it keeps over power-off is not touched). fails: device_lost (the link, or no board says hello),
/// bad_argument (filter, a jumper between lines that do not exist), interrupted (stop).
Result<ConformanceReport> check_conformance(std::unique_ptr<Link> link,
                                            const ConformanceOptions& options = {});

}  // namespace symrig
