// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/budget.hpp"

namespace symrig::acquisition {

/// What a photograph takes before any but the flood-lit one is taken. The rig meters for that one, with as
/// many frames as it needs. A photograph takes one of them at least.
void Budget::note_pace() {
  const auto frames = static_cast<double>(std::max<std::int64_t>({1, photographer_.frames(), since_}));
  pace_ = since_seconds_ /
          (photographer_.plans_exposures() ? frames : static_cast<double>(std::max<std::int64_t>(1, since_)));
}

void Budget::begin_pace() {
  pace_ = seconds_each();
  since_ = photographer_.taken();
  since_seconds_ = photographer_.rig_seconds();
}

double Budget::seconds_each() const {
  const std::int64_t taken = photographer_.taken() - since_;
  return taken > 0 ? (photographer_.rig_seconds() - since_seconds_) / static_cast<double>(taken) : pace_;
}

Budget::Limit Budget::of_user(double pace) const {
  Limit limit;
  const std::int64_t taken = photographer_.taken();
  if (options_.max_patterns > 0) limit.tighten(options_.max_patterns - taken, "max_patterns");
  if (options_.max_seconds > 0) {
    const double spent = photographer_.rig_seconds();
    const double each = pace * seconds_each();
    const double more = each > 0 ? (options_.max_seconds - spent) / each : 0;
    limit.tighten(static_cast<std::int64_t>(std::clamp(more, 0.0, 1e15)), "max_seconds");
  }
  return limit;
}

Budget::Limit Budget::tightest(double pace) const {
  Limit limit = of_user(pace);
  if (algorithm_info(options_.algorithm).yields_to_brute_force)
    limit.tighten(brute_force_left(), "brute_force");
  if (reopening_until_) limit.tighten(reopening_left(), "done");
  return limit;
}

}  // namespace symrig::acquisition
