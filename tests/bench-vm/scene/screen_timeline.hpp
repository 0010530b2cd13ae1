// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/time.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

namespace symrig::bench_vm {

/// A picture on the screen: grid values in [0, 1]. nullptr: no picture, not even the black level.
using Picture = std::shared_ptr<const Image<float>>;

/// Records which pattern was on the screen at which time. Not thread-safe.
class ScreenTimeline {
 public:
  /// A pattern, and the share of an exposure in which it was lit.
  struct Lit {
    std::uint64_t number = 0;  ///< number of pictures before it
    Picture pattern;
    double share = 0;
  };

  /// This picture is on the screen from `since` on. Call it in order of time. Returns true if the picture
  /// differs from the previous one.
  bool change(Nanoseconds since, Picture pattern);
  /// The pictures on the screen during [begin, end), begin < end. Shares sum to 1, or to less if there was no
  /// picture for a while. A picture that was shown twice appears twice.
  std::vector<Lit> during(Nanoseconds begin, Nanoseconds end) const;
  /// The picture on the screen at this time.
  Picture at(Nanoseconds time) const;
  /// When pictures began, within (begin, end).
  std::vector<Nanoseconds> changes_within(Nanoseconds begin, Nanoseconds end) const;
  /// Forgets pictures that ended before this time.
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
