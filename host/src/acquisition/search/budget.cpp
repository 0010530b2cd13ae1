// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/budget.hpp"

namespace symrig::acquisition {

Budget::Limit Budget::of_user() const {
  Limit limit;
  const std::int64_t taken = photographer_.taken();
  if (options_.max_patterns > 0) limit.tighten(options_.max_patterns - taken, "max_patterns");
  if (options_.max_seconds > 0) {
    const double spent = photographer_.rig_seconds();
    const double each = spent / static_cast<double>(std::max<std::int64_t>(1, taken));
    const double more = each > 0 ? (options_.max_seconds - spent) / each : 0;
    limit.tighten(static_cast<std::int64_t>(std::clamp(more, 0.0, 1e15)), "max_seconds");
  }
  return limit;
}

Budget::Limit Budget::tightest() const {
  Limit limit = of_user();
  if (algorithm_info(options_.algorithm).yields_to_brute_force)
    limit.tighten(brute_force_left(), "brute_force");
  if (reopening_until_) limit.tighten(reopening_left(), "done");
  return limit;
}

}  // namespace symrig::acquisition
