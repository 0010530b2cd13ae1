// SPDX-License-Identifier: Apache-2.0

#include "capture_text.hpp"

#include "output.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace symrig::apps {

namespace {

struct Row {
  const char* name;
  const char* key;  ///< as in ErrorNotGiven
  double TransportErrors::*field;
  const char* meaning;
};

constexpr std::array<Row, 7> kRows{{
    {"frobenius", "frobenius", &TransportErrors::frobenius, "all of T"},
    {"indirect", "indirect", &TransportErrors::indirect, "light between lit pixels and other pixels"},
    {"flood", "flood", &TransportErrors::flood, "all projector pixels on"},
    {"relight bar", "relight.bar", &TransportErrors::relight_bar, "a vertical bar"},
    {"relight random", "relight.random", &TransportErrors::relight_random, "a random pattern"},
    {"relight natural", "relight.natural", &TransportErrors::relight_natural, "a smooth picture"},
    {"bar_indirect", "bar_indirect", &TransportErrors::bar_indirect, "the bar's light outside the bar"},
}};

std::string reason_of(const ErrorEstimate& errors, const char* key) {
  const auto why = std::find_if(errors.not_given.begin(), errors.not_given.end(),
                                [&](const ErrorNotGiven& one) { return one.key == key; });
  return why == errors.not_given.end() ? std::string() : ": " + why->reason;
}

}  // namespace

std::string error_table(const ErrorEstimate& errors) {
  std::string text;
  for (const Row& row : kRows) {
    const double value = errors.value.*row.field, width = errors.half_width.*row.field;
    if (std::isnan(value)) {
      text += fmt::format("  {:<16} not given{}\n", row.name, reason_of(errors, row.key));
      continue;
    }
    const std::string bound = width > 0 ? "± " + percent(width) : std::string();
    text += fmt::format("  {:<16} {:>10} {:<12} {}\n", row.name, percent(value), bound, row.meaning);
  }
  return text;
}

std::string undetermined_text(const Undetermined& found) {
  std::string text = fmt::format(
      "the transport is not data-sparse: {} (the search would need at least {} photographs, brute "
      "force {})\n",
      found.reason, grouped(static_cast<double>(found.forecast)),
      grouped(static_cast<double>(found.brute_force)));
  for (const LevelEvidence& level : found.levels)
    if (level.tested > 0)
      text += fmt::format("  level {}: {} of {} nodes are leaves; {} of their energy is unexplained\n",
                          level.level, grouped(static_cast<double>(level.leaves)),
                          grouped(static_cast<double>(level.tested)), percent(level.unexplained));
  return text +
         (found.completed
              ? fmt::format("  brute force measured the rest after {} photographs\n",
                            grouped(static_cast<double>(found.patterns)))
              : "  a budget or the memory limit does not allow brute force: the search went on within it\n");
}

}  // namespace symrig::apps
