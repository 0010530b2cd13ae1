// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/screen_timeline.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

namespace symrig::bench_vm {

/// The screens of several projectors, side by side: their pictures together light the scene. Their refreshes
/// come at different times, so each has a timeline of its own. Not thread-safe.
class JoinedScreens {
 public:
  /// screens: from left to right.
  explicit JoinedScreens(std::size_t screens) : screens_(screens) {}

  /// As ScreenTimeline::change, for one screen.
  bool change(std::size_t screen, Nanoseconds since, Picture pattern);
  /// As ScreenTimeline::during, of the joined pictures. A screen that is off is dark beside one that is on.
  std::vector<ScreenTimeline::Lit> during(Nanoseconds begin, Nanoseconds end);
  void forget_before(Nanoseconds time);
  /// The newest joined picture and its number; nullptr before the first.
  ScreenTimeline::Lit newest();

 private:
  struct Joined {
    std::vector<Picture> parts;
    std::uint64_t number;
    Picture pattern;
  };
  ScreenTimeline::Lit join(const std::vector<Picture>& parts);

  std::vector<ScreenTimeline> screens_;
  std::deque<Joined> joined_;  // the last ones
  std::uint64_t made_ = 0;
};

}  // namespace symrig::bench_vm
