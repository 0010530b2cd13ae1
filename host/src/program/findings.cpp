// SPDX-License-Identifier: Apache-2.0
#include "program/findings.hpp"

#include "symrig/base/time.hpp"
#include "symrig/board/internal/explain.hpp"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>

namespace symrig::program {

bool Findings::fatal() const {
  return std::any_of(all_.begin(), all_.end(),
                     [](const FileFinding& finding) { return finding.severity == Severity::error; });
}

std::vector<FileFinding> Findings::take() {
  const auto key = [](const FileFinding& f) { return std::tie(f.place, f.rule, f.what); };
  std::stable_sort(all_.begin(), all_.end(),
                   [&key](const FileFinding& a, const FileFinding& b) { return key(a) < key(b); });
  all_.erase(std::unique(all_.begin(), all_.end(),
                         [&key](const FileFinding& a, const FileFinding& b) { return key(a) == key(b); }),
             all_.end());
  return std::move(all_);
}

std::string setting(std::string_view key, Nanoseconds value) {
  return fmt::format("{} = \"{}\"", key, base::duration_text(value));
}

std::string bracket_setting(const std::vector<Nanoseconds>& bracket) {
  std::string list;
  for (const Nanoseconds exposure : bracket)
    list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", base::duration_text(exposure));
  return "bracket = [" + list + "]";
}

}  // namespace symrig::program

namespace symrig {

std::string_view name(Severity severity) {
  switch (severity) {
    case Severity::note:
      return "note";
    case Severity::warning:
      return "warning";
    case Severity::error:
      return "error";
  }
  return "error";
}

std::string FileFinding::text(std::string_view file) const {
  return fmt::format("{}:{}: {}: {}: {}{}{}", file, place, name(severity), rule, what,
                     alternative.empty() ? "" : "; ", alternative);
}

}  // namespace symrig
