// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/program.hpp"

#include <cstdint>
#include <utility>
#include <vector>

namespace symrig::test {

/// A small counter-based generator: the same numbers on every machine.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15U);
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31U);
  }
  /// low..high, both included.
  std::uint64_t range(std::uint64_t low, std::uint64_t high) { return low + next() % (high - low + 1); }
  bool chance(unsigned percent) { return next() % 100 < percent; }

 private:
  std::uint64_t state_;
};

/// A program as a tree: what it means, before it is packed.
struct Step {
  enum class Kind : std::uint8_t { word, wait, mark, loop };
  Kind kind = Kind::word;
  std::uint32_t value = 0;  // levels, line, id or rounds
  std::uint32_t ticks = 0;
  bool abort = false;
  protocol::WaitFor edge = protocol::WaitFor::rising;
  std::vector<Step> body;
};

struct ProgramTree {
  std::vector<Step> steps;
  std::uint32_t final_levels = 0;
};

struct TreeOptions {
  std::uint32_t levels_mask = 7;  // outputs to play with
  std::uint32_t shortest = 5;
  std::uint32_t longest = 60;
  unsigned wait_percent = 0;
  std::uint32_t wait_line = 3;
  std::uint32_t most_rounds = 5;
  unsigned depth = 4;
};

inline Step random_word(Random& random, const TreeOptions& options) {
  Step step;
  step.value = static_cast<std::uint32_t>(random.next()) & options.levels_mask;
  step.ticks = static_cast<std::uint32_t>(random.range(options.shortest, options.longest));
  return step;
}

inline std::vector<Step> random_steps(Random& random, const TreeOptions& options, unsigned depth) {
  std::vector<Step> steps;
  const std::uint64_t count = random.range(1, depth == 0 ? 6 : 3);
  for (std::uint64_t i = 0; i < count; ++i) {
    if (depth < options.depth && random.chance(35)) {
      Step loop;
      loop.kind = Step::Kind::loop;
      loop.value = static_cast<std::uint32_t>(random.range(1, options.most_rounds));
      loop.body = random_steps(random, options, depth + 1);
      steps.push_back(std::move(loop));
    } else if (random.chance(options.wait_percent)) {
      Step wait;
      wait.kind = Step::Kind::wait;
      wait.value = options.wait_line;
      wait.ticks = static_cast<std::uint32_t>(random.range(1, options.longest));
      wait.edge = static_cast<protocol::WaitFor>(random.range(0, 2));
      steps.push_back(wait);
    } else if (random.chance(15)) {
      Step mark;
      mark.kind = Step::Kind::mark;
      mark.value = static_cast<std::uint32_t>(random.range(0, 99));
      steps.push_back(mark);
      steps.push_back(random_word(random, options));
    } else {
      steps.push_back(random_word(random, options));
    }
  }
  return steps;
}

inline ProgramTree random_tree(Random& random, const TreeOptions& options) {
  ProgramTree tree;
  tree.steps = random_steps(random, options, 0);
  return tree;
}

inline void pack(const protocol::Record& record, std::vector<std::uint8_t>& out) {
  out.resize(out.size() + protocol::kRecordSize);
  protocol::put_record(record, out.data() + out.size() - protocol::kRecordSize);
}

inline void pack_steps(const std::vector<Step>& steps, std::vector<std::uint8_t>& out) {
  using protocol::Op;
  for (const Step& step : steps) switch (step.kind) {
      case Step::Kind::word:
        pack(protocol::make_record(Op::set_word, step.value, step.ticks), out);
        break;
      case Step::Kind::mark:
        pack(protocol::make_record(Op::mark, step.value, 0), out);
        break;
      case Step::Kind::wait:
        pack(protocol::make_wait({static_cast<std::uint8_t>(step.value), step.edge, step.abort}, step.ticks),
             out);
        break;
      case Step::Kind::loop:
        pack(protocol::make_loop(step.value), out);
        pack_steps(step.body, out);
        pack(protocol::make_record(Op::end_loop, 0, 0), out);
        break;
    }
}

inline std::vector<std::uint8_t> pack(const ProgramTree& tree) {
  std::vector<std::uint8_t> out;
  pack_steps(tree.steps, out);
  pack(protocol::make_record(protocol::Op::end, tree.final_levels, 0), out);
  return out;
}

/// All loops written out, by recursion over the tree: words, waits and marks in the order they happen.
inline void expand(const std::vector<Step>& steps, std::vector<Step>& out) {
  for (const Step& step : steps) {
    if (step.kind != Step::Kind::loop) {
      out.push_back(step);
      continue;
    }
    for (std::uint32_t round = 0; round < step.value; ++round) expand(step.body, out);
  }
}

inline std::vector<Step> expand(const ProgramTree& tree) {
  std::vector<Step> out;
  expand(tree.steps, out);
  return out;
}

}  // namespace symrig::test
