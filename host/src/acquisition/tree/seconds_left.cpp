// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/seconds_left.hpp"

#include "symrig/hdr/bracket_plan.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace symrig::acquisition {
namespace {

constexpr std::size_t kFirstBatch = 4;
constexpr double kLooks = 6;        // batches in what is left
constexpr double kSurely = 1.05;    // photographs of one batch are not all as long
constexpr double kBlack = 1.0 / 8;  // of what is left: all photographs share its error
constexpr double kWait = 2.0 / 60;  // the last photograph may have to wait for two more pictures of a screen
constexpr double kForget = 0.5;     // of what went beyond the plan: black is photographed once

}  // namespace

void SecondsLeft::begin(double now) {
  until_ = now + std::exchange(share_, 1) * std::max(0.0, end_ - now);
  of_this_take_ = false;
}

std::int64_t SecondsLeft::photographs(double now, double seconds) const {
  constexpr double kEndless = 1e15;
  if (!limited() || !(seconds > 0)) return static_cast<std::int64_t>(kEndless);
  return static_cast<std::int64_t>(std::clamp((end_ - now) / seconds, 0.0, kEndless));
}

std::size_t SecondsLeft::together(double now, std::size_t most) const {
  if (!limited()) return most;
  if (!of_this_take_) return std::min(most, kFirstBatch);
  const double few = std::max(0.0, end_ - now) / (kLooks * last_);
  return few < static_cast<double>(most) ? std::max<std::size_t>(1, static_cast<std::size_t>(few)) : most;
}

SecondsEach SecondsLeft::each(double now, double reserved, std::size_t left) const {
  if (!limited() || left == 0) return {};
  const double black = kBlack * std::max(0.0, end_ - now);
  const double fair = std::max(0.0, until_ - now - reserved) / static_cast<double>(left);
  return {whole_most_seconds(std::max(fair / 2, fair - beyond_plan_)), whole_most_seconds(black)};
}

void SecondsLeft::took(double seconds, std::size_t photographs, double allowed) {
  if (photographs == 0) return;
  last_ = seconds / static_cast<double>(photographs);
  of_this_take_ = true;
  shortest_ = shortest_ > 0 ? std::min(shortest_, last_) : last_;
  beyond_plan_ = std::max({0.0, kForget * beyond_plan_, last_ - allowed});
}

std::size_t SecondsLeft::room(double now, std::size_t count, double allowed, bool planned) const {
  if (!limited()) return count;
  const double photograph = of_this_take_ || !planned ? last_ : std::max(allowed + beyond_plan_, shortest_);
  if (!(photograph > 0)) return now < end_ ? count : 0;
  const double fit = std::max(0.0, end_ - now - (planned ? kWait : 0)) / (kSurely * photograph);
  return fit < static_cast<double>(count) ? static_cast<std::size_t>(fit) : count;
}

}  // namespace symrig::acquisition
