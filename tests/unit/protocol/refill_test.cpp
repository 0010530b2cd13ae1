// SPDX-License-Identifier: Apache-2.0
// The rule `refill` against the queue it speaks of: what passes never runs dry, and not much more is refused
// than would.
#include "random_program.hpp"
#include "symrig/protocol/check_program.hpp"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::protocol::refill_test {
namespace {

using test::Step;

/// What a board says of its queue.
struct Queue {
  std::uint32_t segments;
  std::uint32_t refill;
  std::uint32_t poll;
};

constexpr std::uint32_t kLatency = 7;
constexpr std::uint64_t kNone = UINT64_MAX;

BoardConfig plain_config() {
  BoardConfig config;
  for (unsigned k = 0; k < 5; ++k) {
    config.lines[k].configured = true;
    config.lines[k].output = k < 3;
  }
  return config;
}

bool passes(const std::vector<std::uint8_t>& program, const Queue& queue) {
  const BoardConfig config = plain_config();
  ProgramRules rules{&config, 5, 0xFFFFFFFF, kLatency, 1U << 24U, kMaxLoopDepth};
  rules.queue_segments = queue.segments;
  rules.refill_ticks = queue.refill;
  rules.poll_ticks = queue.poll;
  ProgramTiming timing;
  bool refill_broken = false;
  check_program({{program.data(), program.size()}}, rules, timing, [&](const Violation& violation) {
    EXPECT_EQ(violation.rule, Rule::refill);
    refill_broken = true;
    return true;
  });
  return !refill_broken;
}

/// One record as firmware meets it, loops written out.
struct Work {
  enum class Kind : std::uint8_t { word, wait, mark, control };
  Kind kind;
  std::uint64_t ticks;  // how long the engine is busy with it
};

void write_out(const std::vector<Step>& steps, std::vector<Work>& out) {
  for (const Step& step : steps) switch (step.kind) {
      case Step::Kind::word:
        out.push_back({Work::Kind::word, step.ticks});
        break;
      case Step::Kind::wait:
        out.push_back({Work::Kind::wait, kLatency});  // the awaited edge comes at once: the hardest case
        break;
      case Step::Kind::mark:
        out.push_back({Work::Kind::mark, 0});
        break;
      case Step::Kind::loop:
        out.push_back({Work::Kind::control, 0});
        for (std::uint32_t round = 0; round < step.value; ++round) {
          write_out(step.body, out);
          out.push_back({Work::Kind::control, 0});
        }
        break;
    }
}

std::vector<Work> write_out(const test::ProgramTree& tree) {
  std::vector<Work> out;
  write_out(tree.steps, out);
  out.push_back({Work::Kind::word, 5});
  return out;
}

/// Plays a run in time: the engine takes segments as they are due, firmware refills as slowly as the board
/// says it may. Segments are words and waits; a mark is gone when the segment after it begins.
class Play {
 public:
  Play(std::vector<Work> work, const Queue& queue) : work_(std::move(work)), queue_(queue) {}

  /// true: the queue ran dry.
  bool runs_dry() {
    while (can_push()) push();  // before the start: there is all the time in the world
    std::uint64_t now = 0;
    while (!finished()) {
      // The engine is free at `now`: the next segment must have been pushed by then.
      refill_until(now);
      if (segments_.empty()) return true;
      now += segments_.front();
      take(now - segments_.front());
    }
    return false;
  }

 private:
  bool finished() const { return next_ == work_.size() && segments_.empty(); }
  bool can_push() const {
    if (next_ == work_.size()) return false;
    switch (work_[next_].kind) {
      case Work::Kind::word:
        return queued_ < queue_.segments;
      case Work::Kind::wait:
        return queued_ < queue_.segments && waits_ < kMaxWaitsQueued;
      case Work::Kind::mark:
        return marks_ < queue_.segments;
      case Work::Kind::control:
        return true;
    }
    return true;
  }
  void push() {
    const Work& work = work_[next_++];
    if (work.kind == Work::Kind::mark) {
      ++marks_;
      ++marks_before_;
    }
    if (work.kind == Work::Kind::word || work.kind == Work::Kind::wait) {
      segments_.push_back(work.ticks);
      kinds_.push_back({work.kind == Work::Kind::wait, marks_before_});
      marks_before_ = 0;
      ++queued_;
      if (work.kind == Work::Kind::wait) ++waits_;
    }
  }
  /// Firmware works until `now`: a record that is not complete by then does not count yet.
  void refill_until(std::uint64_t now) {
    while (next_ < work_.size()) {
      if (free_at_ == kNone) return;
      if (!can_push()) {
        free_at_ = kNone;  // full: it goes on when there is room again, and somebody has looked
        return;
      }
      if (free_at_ + queue_.refill > now) return;
      free_at_ += queue_.refill;
      push();
    }
  }
  /// The engine begins with the oldest segment at `tick`: it leaves the queue.
  void take(std::uint64_t tick) {
    const bool was_full = !can_push();
    --queued_;
    if (kinds_.front().wait) --waits_;
    marks_ -= kinds_.front().marks;
    segments_.pop_front();
    kinds_.pop_front();
    if (free_at_ == kNone && was_full && can_push()) free_at_ = tick + queue_.poll;
  }

  struct Kind {
    bool wait;
    std::uint32_t marks;  // before it
  };

  std::vector<Work> work_;
  Queue queue_;
  std::size_t next_ = 0;
  std::uint32_t queued_ = 0;
  std::uint32_t waits_ = 0;
  std::uint32_t marks_ = 0;
  std::uint32_t marks_before_ = 0;
  std::uint64_t free_at_ = kNone;  // when firmware can begin with the next record; kNone: the queue is full
  std::deque<std::uint64_t> segments_;
  std::deque<Kind> kinds_;
};

test::ProgramTree random_tree(test::Random& random) {
  test::TreeOptions options;
  options.shortest = 5;
  options.longest = random.chance(50) ? 40 : 200;
  options.most_rounds = random.chance(30) ? 40 : 6;
  options.wait_percent = random.chance(30) ? 20 : 0;
  options.depth = 3;
  return test::random_tree(random, options);
}

TEST(Refill, what_passes_never_runs_dry) {
  test::Random random(41);
  int passed = 0;
  int refused_and_dry = 0;
  for (int k = 0; k < 4'000; ++k) {
    const test::ProgramTree tree = random_tree(random);
    const Queue queue{static_cast<std::uint32_t>(random.range(8, 200)),
                      static_cast<std::uint32_t>(random.range(1, 120)),
                      static_cast<std::uint32_t>(random.range(0, 2'000))};
    const std::vector<Work> work = write_out(tree);
    if (work.size() > 20'000) continue;
    const bool dry = Play(work, queue).runs_dry();
    if (passes(test::pack(tree), queue)) {
      ++passed;
      ASSERT_FALSE(dry) << "program " << k;
    } else if (dry) {
      ++refused_and_dry;
    }
  }
  EXPECT_GT(passed, 200);
  EXPECT_GT(refused_and_dry, 200);
}

TEST(Refill, what_passes_in_loops_passes_written_out) {
  test::Random random(42);
  int refused = 0;
  int looked = 0;
  for (int k = 0; k < 1'000; ++k) {
    test::ProgramTree tree = random_tree(random);
    const Queue queue{static_cast<std::uint32_t>(random.range(8, 100)),
                      static_cast<std::uint32_t>(random.range(1, 120)), 100};
    const auto flatten = [](const std::vector<Step>& steps, auto&& self) -> std::vector<Step> {
      std::vector<Step> out;
      for (const Step& step : steps) {
        if (step.kind != Step::Kind::loop) {
          out.push_back(step);
          continue;
        }
        for (std::uint32_t round = 0; round < step.value; ++round)
          for (Step& inner : self(step.body, self)) out.push_back(inner);
      }
      return out;
    };
    test::ProgramTree flat{flatten(tree.steps, flatten), 0};
    if (flat.steps.size() > 5'000) continue;
    ++looked;
    // Written out there are fewer records to expand: whatever loops may do, their rounds may do.
    if (passes(test::pack(tree), queue)) {
      EXPECT_TRUE(passes(test::pack(flat), queue)) << "program " << k;
    } else {
      ++refused;
    }
  }
  EXPECT_GT(looked, 300);
  EXPECT_GT(refused, 50);
}

Step word(std::uint32_t ticks) {
  Step step;
  step.ticks = ticks;
  return step;
}

Step rounds_of(std::uint32_t rounds, std::vector<Step> body) {
  Step loop;
  loop.kind = Step::Kind::loop;
  loop.value = rounds;
  loop.body = std::move(body);
  return loop;
}

/// The largest count that is still true, by halving; true at 1, false at `far`.
template <class Holds>
std::uint32_t last_true(std::uint32_t far, Holds holds) {
  std::uint32_t good = 1;
  while (far - good > 1) {
    const std::uint32_t middle = good + (far - good) / 2;
    (holds(middle) ? good : far) = middle;
  }
  return good;
}

TEST(Refill, not_much_is_refused_that_would_have_gone_well) {
  // Rounds of one short word in a loop: how many pass, and how many the queue really bears.
  const Queue queue{256, 100, 5'000};
  for (const std::uint32_t ticks : {6U, 50U, 150U, 199U}) {
    const auto tree = [&](std::uint32_t rounds) {
      return test::ProgramTree{{rounds_of(rounds, {word(ticks)})}, 0};
    };
    const std::uint32_t allowed =
        last_true(1'000'000, [&](std::uint32_t n) { return passes(test::pack(tree(n)), queue); });
    const std::uint32_t borne =
        last_true(300'000, [&](std::uint32_t n) { return !Play(write_out(tree(n)), queue).runs_dry(); });
    EXPECT_LE(allowed, borne) << ticks;
    // What is given away: a wait's weight of slots, the control records that take no slot, and the burst that
    // the model lets begin before the queue is full again.
    EXPECT_GT(allowed, borne / 3) << ticks;
  }
  // From 200 ticks a round on (word and end_loop) it goes on for ever.
  EXPECT_TRUE(passes(test::pack(test::ProgramTree{{rounds_of(0xFFFFFFFF, {word(200)})}, 0}), queue));
}

TEST(Refill, the_finding_tells_how_many_rounds_are_fed) {
  const Queue queue{256, 100, 5'000};
  const BoardConfig config = plain_config();
  ProgramRules rules{&config, 5, 0xFFFFFFFF, kLatency, 1U << 20U, kMaxLoopDepth};
  rules.queue_segments = queue.segments;
  rules.refill_ticks = queue.refill;
  rules.poll_ticks = queue.poll;
  const auto program = test::pack(test::ProgramTree{{rounds_of(1'000'000, {word(50)})}, 0});
  ProgramTiming timing;
  Violation found;
  check_program({{program.data(), program.size()}}, rules, timing, [&](const Violation& violation) {
    found = violation;
    return false;
  });
  ASSERT_EQ(found.rule, Rule::refill);
  EXPECT_EQ(found.actual, 1'000'000U);
  const auto fed = static_cast<std::uint32_t>(found.limit);
  EXPECT_TRUE(passes(test::pack(test::ProgramTree{{rounds_of(fed - 1, {word(50)})}, 0}), queue));
  EXPECT_FALSE(passes(test::pack(test::ProgramTree{{rounds_of(fed + 1, {word(50)})}, 0}), queue));
}

TEST(Refill, a_board_with_nothing_to_refill_refuses_nothing) {
  EXPECT_TRUE(passes(test::pack(test::ProgramTree{{rounds_of(0xFFFFFFFF, {word(5)})}, 0}), {2, 0, 0}));
}

}  // namespace
}  // namespace symrig::protocol::refill_test
