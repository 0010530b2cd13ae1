// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/time_to_go.hpp"

#include <algorithm>
#include <cmath>

namespace symrig {
namespace {

constexpr double kShortest = 0.3;  // s; before this, the start-up dominates the measurement
constexpr double kWindow =
    0.5;  // of the elapsed time; so photographs that came from a log soon stop counting
constexpr double kClose = 1e-3;  // of the elapsed time; moments that are closer are one
constexpr double kRoom =
    3;  // largest ratio of the bounds: the mean is then wrong by less than a factor of two
constexpr double kFinishing = 0.3;  // of the elapsed time; upper bound for the work after the last unit
constexpr double kSlower =
    1.5;  // later units take at most this much longer, because the known transport grows

}  // namespace

void TimeToGo::report(const ProgressEvent& event, double seconds) {
  const std::int64_t done = event.computing ? event.steps.done : event.done;
  const std::int64_t expected = event.computing ? event.steps.expected : event.expected;
  // The count of another job, or of another kind.
  if (event.computing != computing_ || (!moments_.empty() && done < moments_.back().done)) moments_.clear();
  computing_ = event.computing;
  const bool soon = moments_.size() > 2 && seconds - moments_[moments_.size() - 2].seconds < kClose * seconds;
  if (soon) moments_.pop_back();
  moments_.push_back({seconds, done});
  // The first moment that stays begins the window.
  while (moments_.size() > 2 && moments_[1].seconds <= seconds * (1 - kWindow)) moments_.pop_front();
  left_ = std::max<std::int64_t>(0, expected - done);
  later_ = expected > 0 ? event.later : UnitsToCome{};
}

/// Seconds for each unit.
std::optional<double> TimeToGo::pace() const {
  if (moments_.size() < 2 || moments_.back().seconds < kShortest) return std::nullopt;
  const auto done = static_cast<double>(moments_.back().done - moments_.front().done);
  const double took = moments_.back().seconds - moments_.front().seconds;
  if (!(done > 0) || !(took > 0)) return std::nullopt;
  return took / done;
}

std::optional<double> TimeToGo::seconds() const {
  const auto each = pace();
  if (!each || !later_.known()) return std::nullopt;
  const double least = *each * static_cast<double>(left_ + later_.least);
  const double most =
      kSlower * *each * static_cast<double>(left_ + later_.most) + kFinishing * moments_.back().seconds;
  if (!(least > 0) || most > kRoom * least) return std::nullopt;
  return std::sqrt(least * most);
}

}  // namespace symrig
