// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/screen_timeline.hpp"

#include <algorithm>
#include <utility>

namespace symrig::bench_vm {

namespace {

bool same(const Picture& a, const Picture& b) {
  if (a == nullptr || b == nullptr) return a == b;
  return std::ranges::equal(a->values(), b->values());
}

}  // namespace

bool ScreenTimeline::change(Nanoseconds since, Picture pattern) {
  if (changes_.empty() ? pattern == nullptr : same(changes_.back().pattern, pattern)) return false;
  const std::uint64_t number = pattern ? shown_++ : shown_;
  changes_.push_back({since, number, std::move(pattern)});
  return true;
}

std::vector<ScreenTimeline::Lit> ScreenTimeline::during(Nanoseconds begin, Nanoseconds end) const {
  std::vector<Lit> lit;
  for (std::size_t i = 0; i < changes_.size(); ++i) {
    const Nanoseconds from = std::max(begin, changes_[i].since);
    const Nanoseconds to = i + 1 < changes_.size() ? std::min(end, changes_[i + 1].since) : end;
    if (from >= to || changes_[i].pattern == nullptr) continue;
    const double share = from == begin && to == end ? 1 : seconds(to - from) / seconds(end - begin);
    lit.push_back({changes_[i].number, changes_[i].pattern, share});
  }
  return lit;
}

Picture ScreenTimeline::at(Nanoseconds time) const {
  Picture shown;
  for (const Change& change : changes_)
    if (change.since <= time) shown = change.pattern;
  return shown;
}

std::vector<Nanoseconds> ScreenTimeline::changes_within(Nanoseconds begin, Nanoseconds end) const {
  std::vector<Nanoseconds> times;
  for (const Change& change : changes_)
    if (change.since > begin && change.since < end) times.push_back(change.since);
  return times;
}

void ScreenTimeline::forget_before(Nanoseconds time) {
  while (changes_.size() > 1 && changes_[1].since <= time) changes_.pop_front();
}

ScreenTimeline::Lit ScreenTimeline::newest() const {
  if (changes_.empty()) return {};
  return {changes_.back().number, changes_.back().pattern, 1};
}

}  // namespace symrig::bench_vm
