// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/joined_screens.hpp"

#include <algorithm>
#include <memory>
#include <utility>

namespace symrig::bench_vm {

namespace {

constexpr std::size_t kKept = 16;  // joined pictures that an exposure, or the next one, may ask for again

/// Pictures of one size, side by side.
Picture side_by_side(const std::vector<Picture>& parts) {
  const auto on = std::ranges::find_if(parts, [](const Picture& part) { return part != nullptr; });
  if (on == parts.end()) return nullptr;
  const Grid part = (*on)->grid();
  const std::size_t cols = part.cols, row = parts.size() * cols;
  auto all = std::make_shared<Image<float>>(Grid{part.rows, static_cast<int>(row)}, 1);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (parts[k] == nullptr) continue;
    const auto from = parts[k]->values();
    for (std::size_t i = 0; i < from.size(); ++i)
      all->values()[i / cols * row + k * cols + i % cols] = from[i];
  }
  return all;
}

}  // namespace

bool JoinedScreens::change(std::size_t screen, Nanoseconds since, Picture pattern) {
  return screens_[screen].change(since, std::move(pattern));
}

void JoinedScreens::forget_before(Nanoseconds time) {
  for (ScreenTimeline& screen : screens_) screen.forget_before(time);
}

std::vector<ScreenTimeline::Lit> JoinedScreens::during(Nanoseconds begin, Nanoseconds end) {
  if (screens_.size() == 1) return screens_[0].during(begin, end);
  // Between two changes, of whatever screen, the joined picture is one.
  std::vector<Nanoseconds> times{begin, end};
  for (const ScreenTimeline& screen : screens_) {
    const auto changes = screen.changes_within(begin, end);
    times.insert(times.end(), changes.begin(), changes.end());
  }
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  std::vector<ScreenTimeline::Lit> lit;
  for (std::size_t k = 0; k + 1 < times.size(); ++k) {
    std::vector<Picture> parts;
    for (const ScreenTimeline& screen : screens_) parts.push_back(screen.at(times[k]));
    ScreenTimeline::Lit one = join(parts);
    if (one.pattern == nullptr) continue;
    one.share = times.size() == 2 ? 1 : seconds(times[k + 1] - times[k]) / seconds(end - begin);
    lit.push_back(std::move(one));
  }
  return lit;
}

ScreenTimeline::Lit JoinedScreens::newest() {
  if (screens_.size() == 1) return screens_[0].newest();
  std::vector<Picture> parts;
  for (const ScreenTimeline& screen : screens_) parts.push_back(screen.newest().pattern);
  return join(parts);
}

/// Equal parts give the same picture again, so that its light is computed once.
ScreenTimeline::Lit JoinedScreens::join(const std::vector<Picture>& parts) {
  const auto known = std::ranges::find(joined_, parts, &Joined::parts);
  if (known != joined_.end()) return {known->number, known->pattern, 1};
  Picture pattern = side_by_side(parts);
  if (pattern == nullptr) return {};
  if (joined_.size() == kKept) joined_.pop_front();
  joined_.push_back({parts, made_++, std::move(pattern)});
  return {joined_.back().number, joined_.back().pattern, 1};
}

}  // namespace symrig::bench_vm
