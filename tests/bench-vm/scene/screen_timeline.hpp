// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/units.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

namespace symrig::bench_vm {

/// What was on the screen: grid values in [0, 1]. nullptr: no picture at all, not even the black level.
using Picture = std::shared_ptr<const Image<float>>;

/// Which pattern was on the screen when. Not thread-safe.
class ScreenTimeline {
 public:
  /// A pattern that was lit for a share of an exposure.
  struct Lit {
    std::uint64_t number = 0;  ///< pictures shown before it
    Picture pattern;
    double share = 0;
  };

  /// From `since` on this is on the screen. In order of time; the same picture again is no change.
  /// Returns whether it was one.
  bool change(Nanoseconds since, Picture pattern);
  /// What was on the screen during [begin, end), begin < end. Shares add up to 1, or to less if there was no
  /// picture for a while. A picture that came twice is there twice.
  std::vector<Lit> during(Nanoseconds begin, Nanoseconds end) const;
  /// Forgets what was gone before this time.
  void forget_before(Nanoseconds time);
  /// The newest picture and its number; nullptr before the first.
  Lit newest() const;

 private:
  struct Change {
    Nanoseconds since;
    std::uint64_t number;
    Picture pattern;
  };
  std::deque<Change> changes_;
  std::uint64_t shown_ = 0;
};

}  // namespace symrig::bench_vm
