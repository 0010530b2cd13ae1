// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

namespace symrig::acquisition {

/// The longest that a photograph may take, and photographs of the dark projector that it may have to wait for
/// (Expectation). [s]
struct SecondsEach {
  double photograph = std::numeric_limits<double>::infinity();
  double black = std::numeric_limits<double>::infinity();
};

/// Keeps photographs within a budget of seconds on the rig's clock. A batch is planned while the one before
/// is photographed, so what it may take is set before it is known what that one took. All times in seconds;
/// `now` is the rig's clock.
class SecondsLeft {
 public:
  /// The capture must have ended by then.
  void end_by(double clock) { end_ = clock; }
  /// The share of what is left that the photographs of the next take() may need; without a word, all of it.
  void may_spend(double share) { share_ = share; }
  bool limited() const { return end_ < std::numeric_limits<double>::infinity(); }
  /// Photographs of this length that fit.
  std::int64_t photographs(double now, double seconds) const;

  /// A take() begins.
  void begin(double now);
  /// How many of `most` photographs to take together, so that the clock is looked at often enough.
  std::size_t together(double now, std::size_t most) const;
  /// For each of the `left` photographs that have no plan yet, while others that have one may still take
  /// `reserved`.
  SecondsEach each(double now, double reserved, std::size_t left) const;
  /// What a batch took, and what each of its photographs was allowed.
  void took(double seconds, std::size_t photographs, double allowed);
  /// How many of the next `count` photographs are sure to end in time, each planned for `allowed`.
  /// planned: exposures are.
  std::size_t room(double now, std::size_t count, double allowed, bool planned) const;

 private:
  double end_ = std::numeric_limits<double>::infinity();
  double share_ = 1;
  double until_ = 0;           ///< the present take()
  double last_ = 0;            ///< what a photograph of the last batch took; 0: none was taken
  bool of_this_take_ = false;  ///< so did that batch
  double shortest_ = 0;        ///< of the photographs so far; 0: none was taken
  /// What a photograph takes beyond its plan: it waits for the projector.
  double beyond_plan_ = 0;
};

}  // namespace symrig::acquisition
