// SPDX-License-Identifier: Apache-2.0
#include "undetermined_text.hpp"

#include "console.hpp"

#include <fmt/format.h>

namespace symrig::apps {

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
