// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/program/compile.hpp"

#include <string>
#include <utility>
#include <vector>

namespace symrig::program {

/// Collects findings. The rule names come from the table in lint_rules.cpp.
class Findings {
 public:
  void error(int place, std::string_view rule, std::string what, std::string alternative) {
    add(Severity::error, place, rule, std::move(what), std::move(alternative));
  }
  void warning(int place, std::string_view rule, std::string what, std::string alternative) {
    add(Severity::warning, place, rule, std::move(what), std::move(alternative));
  }
  void note(int place, std::string_view rule, std::string what, std::string alternative) {
    add(Severity::note, place, rule, std::move(what), std::move(alternative));
  }
  void add(Severity severity, int place, std::string_view rule, std::string what, std::string alternative) {
    all_.push_back({severity, place, std::string(rule), std::move(what), std::move(alternative)});
  }
  bool fatal() const;
  /// The findings, sorted by line of the file, without duplicates.
  std::vector<FileFinding> take();

 private:
  std::vector<FileFinding> all_;
};

/// `key = "1 ms"`
std::string setting(std::string_view key, Nanoseconds value);
/// `bracket = ["1 ms", "2 ms"]`
std::string bracket_setting(const std::vector<Nanoseconds>& bracket);

}  // namespace symrig::program
