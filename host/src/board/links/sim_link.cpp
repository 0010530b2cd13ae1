// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/link.hpp"
#include "symrig/board/ticks.hpp"
#include "symrig/boards/sim_board.hpp"

#include <algorithm>

namespace symrig {
namespace {

class SimLink final : public Link {
 public:
  explicit SimLink(board_sim::SimBoard& board)
      : board_(board), rate_{board.config().tick_hz}, opened_(board.now()) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override {
    board_.write(bytes);
    return {};
  }

  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override {
    // A wait of less than a tick lasts one tick. Otherwise a caller that waits for a time would never end.
    const std::uint64_t nearest = rate_.ticks(timeout).count;
    const std::uint64_t deadline = board_.now() + nearest + (rate_.nanoseconds({nearest}) < timeout ? 1 : 0);
    std::vector<std::uint8_t> bytes = board_.read();
    while (bytes.empty() && board_.next_event() <= deadline) {
      board_.advance();
      bytes = board_.read();
    }
    if (bytes.empty()) board_.advance_to(deadline);
    return bytes;
  }

  Nanoseconds now() const override { return rate_.nanoseconds(Ticks{board_.now() - opened_}); }
  SteadyTime opened() const override { return {rate_.nanoseconds(Ticks{opened_})}; }

 private:
  board_sim::SimBoard& board_;
  TickRate rate_;
  std::uint64_t opened_;
};

}  // namespace

std::unique_ptr<Link> make_sim_link(board_sim::SimBoard& board) {
  return std::make_unique<SimLink>(board);
}

}  // namespace symrig
