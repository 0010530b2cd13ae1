// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
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

/// One named test of a rule in protocol/PROTOCOL.md that every board must keep.
struct CheckInfo {
  std::string_view name;  ///< "wire.corrupted"
  std::string_view what;  ///< the tested rule in a few words
};

struct CheckResult {
  std::string name;
  CheckOutcome outcome = CheckOutcome::passed;
  std::string detail;  ///< failed: the expected and the actual value; skipped: the reason
};

struct ConformanceOptions {
  std::string filter;            ///< regular expression: runs only checks whose name matches. Empty: all
  std::optional<Jumper> jumper;  ///< without one, checks that need it are skipped
  std::function<void(const CheckResult&)> on_result;  ///< called after each check
  std::function<bool()> stop;  ///< called before each check: true = end now and leave the board safe
};

struct ConformanceReport {
  std::string board, firmware_version, unique_id;
  std::vector<CheckResult> results;

  std::size_t count(CheckOutcome outcome) const;
  /// True if no check failed and at least one passed.
  bool passed() const;
};

/// All checks, in the order of their execution.
std::vector<CheckInfo> conformance_checks();

/// Tests the board at the other end of the link. Needs only the link, and uses the link's clock, so it works
/// in virtual time and on a cable. Outputs change: nothing that lights, heats or shoots may be wired to them.
/// The board never stays armed. At the end it is safe and has no configuration; its permanent memory is not
/// changed. fails: device_lost (the link is lost, or no board answers Hello), bad_argument (the filter, or
/// the lines of the jumper), interrupted (stop).
Result<ConformanceReport> check_conformance(std::unique_ptr<Link> link,
                                            const ConformanceOptions& options = {});

}  // namespace symrig
