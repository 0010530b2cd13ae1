// SPDX-License-Identifier: Apache-2.0
// Golden programs: an emulated board and the simulated board play the same bytes, and the edges are compared.
#pragma once

#include "assert_ok.hpp"
#include "symrig/board/board.hpp"
#include "symrig/boards/sim_board.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <ostream>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::test {

/// An output changed. tick: counted from the begin of the run; whole, if the emulated board's clock is the
/// tick.
struct GoldenChange {
  double tick;
  unsigned line;
  bool level;

  bool operator==(const GoldenChange&) const = default;
};

inline void PrintTo(const GoldenChange& change, std::ostream* out) {
  *out << change.tick << ": line " << change.line << (change.level ? " high" : " low");
}

/// One run: what the outputs did, what vsync did, and the receipt.
struct GoldenRun {
  std::vector<GoldenChange> changes;
  std::vector<std::int64_t> vsync;  ///< ticks of its edges: rising, falling, rising, ...
  Receipt receipt;
};

struct GoldenProgram {
  const char* name;
  std::function<Result<Program>(const BoardInfo&)> make;
  Nanoseconds vsync_period{0};
  double tolerance = 0;  ///< ticks
};

inline void PrintTo(const GoldenProgram& golden, std::ostream* out) {
  *out << golden.name;
}

/// Replays vsync and writes down what the outputs do.
class GoldenWiring final : public board_sim::Peripheral {
 public:
  /// outputs: lines 0 to outputs - 1. vsync: input. edges: of vsync, in ticks after `origin`.
  GoldenWiring(unsigned outputs, int vsync, std::uint64_t origin, std::vector<std::int64_t> edges)
      : outputs_(outputs), vsync_(vsync), origin_(origin), edges_(std::move(edges)) {}

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, board_sim::SimBoard&) override {
    const auto at = static_cast<std::int64_t>(tick - origin_);
    for (unsigned k = 0; k < outputs_; ++k)
      if ((((levels ^ levels_) >> k) & 1U) != 0)
        changes.push_back({static_cast<double>(at), k, ((levels >> k) & 1U) != 0});
    levels_ = levels;
  }
  std::uint64_t next_event() const override {
    return next_ < edges_.size() ? origin_ + static_cast<std::uint64_t>(edges_[next_]) : board_sim::kNever;
  }
  void on_event(std::uint64_t, board_sim::SimBoard& board) override {
    board.set_input(vsync_, next_++ % 2 == 0);
  }

  std::vector<GoldenChange> changes;

 private:
  unsigned outputs_;
  int vsync_;
  std::uint64_t origin_;
  std::vector<std::int64_t> edges_;
  std::size_t next_ = 0;
  std::uint32_t levels_ = 0;
};

/// A simulated board with the lines and the timing of `info`, so that programs are the same bytes.
inline board_sim::SimBoardConfig golden_config(const BoardInfo& info) {
  board_sim::SimBoardConfig config;
  config.lines.clear();
  for (const LineInfo& line : info.lines) config.lines.push_back({line.name, line.output});
  config.tick_hz = info.rate.hz;
  config.min_dwell = static_cast<std::uint32_t>(info.min_dwell.count);
  config.wait_latency = static_cast<std::uint32_t>(info.wait_latency.count);
  config.engine_segments = info.queue_segments;
  return config;
}

/// The program on the simulated board, with the very pulses of vsync that the emulated board saw from `from`
/// ticks after the begin of its run on.
inline GoldenRun golden_run_on_sim(const BoardInfo& info, const Program& program,
                                   const std::vector<std::int64_t>& vsync, std::int64_t from) {
  using namespace std::chrono_literals;
  constexpr std::uint64_t kBegin = 10'000'000;
  board_sim::SimBoard sim(golden_config(info));
  std::vector<std::int64_t> seen;
  for (std::size_t k = 0; k + 1 < vsync.size(); k += 2)
    if (vsync[k] >= from) seen.insert(seen.end(), {vsync[k], vsync[k + 1]});
  unsigned outputs = 0;
  while (outputs < info.lines.size() && info.lines[outputs].output) ++outputs;
  GoldenWiring wiring(outputs, info.line("vsync"), kBegin, seen);
  sim.attach(wiring);
  GoldenRun run;
  auto board = Board::connect(make_sim_link(sim));
  EXPECT_TRUE(board.ok());
  if (!board) return run;
  EXPECT_TRUE(board->configure({}).ok());
  EXPECT_TRUE(board->upload(program).ok());
  EXPECT_TRUE(board->arm().ok());
  EXPECT_TRUE(board->start_at(Ticks{kBegin}).ok());
  auto receipt = board->wait(60s);
  EXPECT_TRUE(receipt.ok());
  if (receipt) run.receipt = *receipt;
  run.changes = wiring.changes;
  return run;
}

/// What must be the same on any two boards.
inline void expect_same_run(const GoldenRun& real, const GoldenRun& simulated) {
  EXPECT_EQ(real.receipt.end, RunEnd::completed);
  EXPECT_EQ(simulated.receipt.end, RunEnd::completed);
  EXPECT_EQ(real.receipt.program_hash, simulated.receipt.program_hash);
  EXPECT_EQ(real.receipt.steps, simulated.receipt.steps);
  EXPECT_EQ(real.receipt.late, 0U);
  EXPECT_GT(real.changes.size(), 10U);
  EXPECT_EQ(real.changes.size(), simulated.changes.size());
  EXPECT_EQ(real.receipt.marks.size(), simulated.receipt.marks.size());
}

}  // namespace symrig::test
