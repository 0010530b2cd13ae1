// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

namespace symrig {

/// Bounds on the number of units after the current stage.
struct UnitsToCome {
  std::int64_t least = 0;
  std::int64_t most = -1;  ///< below 0: not known

  bool known() const { return most >= least; }
};
inline constexpr UnitsToCome kNoneToCome{0, 0};

/// Computing work of one stage, in steps (Work::kStep).
struct StepCount {
  std::int64_t done = 0;
  std::int64_t expected = 0;  ///< by the end of the stage; 0 = not known
};

/// The state of a long job. The library reports it; only apps/ print it.
struct ProgressEvent {
  std::string_view stage;     ///< "level 3", "decoding", ...
  std::int64_t done = 0;      ///< units finished (photographs in a capture)
  std::int64_t expected = 0;  ///< units expected in this stage so far; 0 = not known
  UnitsToCome later = {};     ///< after this stage
  StepCount steps = {};       ///< of a capture: what the computer has done in this stage
  bool computing = false;     ///< the stage has no units of its own: its steps move, `done` stands still
};

/// Called by the thread that does the work. Return false to stop the job; it then ends with
/// ErrorCode::interrupted.
using Progress = std::function<bool(const ProgressEvent&)>;

/// Thrown by Work where a job is asked to stop. It unwinds loops and threads; stoppable() turns it into an
/// Error before it leaves the library.
struct Stopped {};

/// Counts the work of a long job, tells it to its Progress, and stops the job if that asks for it. Whoever
/// does a part of the job has a copy. Counting changes no result.
///
/// Any thread counts. Only the thread that made the first copy calls the Progress, because a callback may
/// belong to that thread. So it counts too, or looks from time to time while it waits for others.
class Work {
 public:
  /// Operations (a multiplication and an addition) of a step. A refit does one in 2 to 4 ms with one thread
  /// of 2.0 GHz, from 48x48 to 256x256.
  static constexpr std::int64_t kStep = std::int64_t{1} << 24;

  /// Counts nothing and never stops.
  Work() = default;
  /// progress: may be empty.
  explicit Work(Progress progress);

  /// Photographs have been taken, or are asked for next. Begins the stage if it is another one. event.steps
  /// is filled in. false: the job is to stop. By the thread of the job.
  [[nodiscard]] bool tell(ProgressEvent event) const;
  /// Begins a stage that takes no photographs. operations: expected in it; 0: not known. taken: photographs
  /// by then, where tell() has not said so. By the thread of the job.  throws: Stopped.
  void begin(std::string_view stage, std::int64_t operations = 0,
             std::optional<std::int64_t> taken = {}) const;
  /// Counts operations of the stage.  throws: Stopped.
  void add(std::int64_t operations) const;
  /// Counts them without asking.
  void count(std::int64_t operations) const noexcept;
  /// Tells the count, while other threads work. By the thread of the job.  throws: Stopped.
  void look() const;

  bool stopped() const;
  /// What a capture that was stopped ends with: how far it was. By the thread of the job.
  Error stop_error() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

/// Counts operations of one thread, and hands them on some at a time: for loops with short turns.
class Tally {
 public:
  explicit Tally(const Work& work) : work_(work) {}
  Tally(const Tally&) = delete;
  Tally& operator=(const Tally&) = delete;
  ~Tally() { work_.count(count_); }

  /// throws: Stopped.
  void add(std::int64_t operations) {
    count_ += operations;
    if (count_ >= kSome) hand_on();
  }

 private:
  static constexpr std::int64_t kSome = Work::kStep / 4;
  void hand_on() {
    const std::int64_t some = count_;
    count_ = 0;
    work_.add(some);
  }

  const Work& work_;
  std::int64_t count_ = 0;
};

/// What a job returns, or what it ends with where it is stopped.
template <class Job>
auto stoppable(const Work& work, Job&& job) -> decltype(job()) {
  try {
    return std::forward<Job>(job)();
  } catch (const Stopped&) {
    return work.stop_error();
  }
}

/// Estimates the remaining time of a long job from its progress events. It gives no estimate that may be
/// wrong by more than a factor of two. So it needs a lower and an upper bound less than a factor of four
/// apart, and returns their geometric mean.
class TimeToGo {
 public:
  /// seconds: time since the job began; must not decrease.
  void report(const ProgressEvent& event, double seconds);

  /// The remaining seconds. Nothing if they are not known: no rate yet, later stages of unknown length, or
  /// only the work after the last unit remains.
  std::optional<double> seconds() const;

 private:
  struct Moment {
    double seconds;
    std::int64_t done;
  };
  std::optional<double> pace() const;

  std::deque<Moment> moments_;  ///< of the last half of the elapsed time
  bool computing_ = false;      ///< they count steps
  std::int64_t left_ = 0;       ///< units of this stage
  UnitsToCome later_;
};

}  // namespace symrig
