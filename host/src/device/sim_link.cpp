// SPDX-License-Identifier: Apache-2.0
#include "symrig/boards/sim_board.hpp"
#include "symrig/device/link.hpp"
#include "symrig/device/ticks.hpp"

#include <algorithm>

namespace symrig::device {
namespace {

class SimLink final : public Link {
 public:
  explicit SimLink(boards::SimBoard& board)
      : board_(board), rate_{board.config().tick_hz}, opened_(board.now()) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override {
    board_.write(bytes);
    return {};
  }

  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override {
    // At least a tick: whoever waits for the rest of a time that is not whole ticks must come to its end.
    const std::uint64_t wait =
        std::max<std::uint64_t>(rate_.ticks(timeout).count, timeout.count() > 0 ? 1 : 0);
    const std::uint64_t deadline = board_.now() + wait;
    std::vector<std::uint8_t> bytes = board_.read();
    while (bytes.empty() && board_.next_event() <= deadline) {
      board_.advance();
      bytes = board_.read();
    }
    if (bytes.empty()) board_.advance_to(deadline);
    return bytes;
  }

  Nanoseconds now() const override { return rate_.nanoseconds(Ticks{board_.now() - opened_}); }

 private:
  boards::SimBoard& board_;
  TickRate rate_;
  std::uint64_t opened_;
};

}  // namespace

std::unique_ptr<Link> make_sim_link(boards::SimBoard& board) {
  return std::make_unique<SimLink>(board);
}

}  // namespace symrig::device
