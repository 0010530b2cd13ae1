// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/text.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/internal/links.hpp"
#include "symrig/board/link.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/boards/sim_peripherals.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

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

namespace symrig::board {
namespace {

/// Wires from outputs to inputs.
class Plug final : public board_sim::Peripheral {
 public:
  void add(int from, int to) { wires_.emplace_back(from, to); }
  void outputs_changed(std::uint64_t, std::uint32_t levels, board_sim::SimBoard& board) override {
    // The levels of a trip can come while this loop reports those that opened the interlock.
    latest_ = levels;
    for (const auto& [from, to] : wires_) board.set_input(to, ((latest_ >> from) & 1U) != 0);
  }
  std::uint64_t next_event() const override { return board_sim::kNever; }
  void on_event(std::uint64_t, board_sim::SimBoard&) override {}

 private:
  std::vector<std::pair<int, int>> wires_;
  std::uint32_t latest_ = 0;
};

/// The board does not own its peripherals, and they must outlive it.
class OwningSimLink final : public Link {
 public:
  OwningSimLink() : link_(make_sim_link(board_)) {}

  Result<void> wire_up(const DeviceUri& uri) {
    if (uri.jumper_from.empty()) {
      board_.attach(projector_.emplace(board_));
      board_.attach(camera_.emplace(board_));
      return {};
    }
    // "OUT:IN,OUT:IN": the URI splits it at the first colon.
    std::string_view left = uri.jumper_to;
    std::string from(uri.jumper_from);
    for (;;) {
      const std::size_t comma = left.find(',');
      SYMRIG_CHECK(add_wire(from, std::string(left.substr(0, comma))));
      if (comma == std::string_view::npos) break;
      left = left.substr(comma + 1);
      const std::size_t colon = left.find(':');
      from = left.substr(0, colon);
      left = colon == std::string_view::npos ? std::string_view() : left.substr(colon + 1);
    }
    board_.attach(plug_);
    return {};
  }

  Result<void> send(std::span<const std::uint8_t> bytes) override { return link_->send(bytes); }
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override { return link_->receive(timeout); }
  Nanoseconds now() const override { return link_->now(); }
  SteadyTime opened() const override { return link_->opened(); }

 private:
  Result<void> add_wire(const std::string& output, const std::string& input) {
    SYMRIG_TRY(const int from, line(output, true));
    SYMRIG_TRY(const int to, line(input, false));
    plug_.add(from, to);
    return {};
  }
  Result<int> line(const std::string& name, bool output) const {
    const int found = board_.line(name);
    if (found >= 0 && board_.config().lines[found].output == output) return found;
    std::vector<std::string> known;
    for (const board_sim::SimLine& one : board_.config().lines)
      if (one.output == output) known.push_back(one.name);
    const char* kind = output ? "output" : "input";
    return Error{ErrorCode::unknown_name, fmt::format("the simulated board has no {} '{}'", kind, name),
                 nearest_hint(name, known)};
  }

  board_sim::SimBoard board_;
  std::optional<board_sim::SimProjector> projector_;
  std::optional<board_sim::SimCamera> camera_;
  Plug plug_;
  std::unique_ptr<Link> link_;
};

}  // namespace

Result<std::unique_ptr<Link>> open_sim_device(const DeviceUri& uri) {
  auto link = std::make_unique<OwningSimLink>();
  SYMRIG_CHECK(link->wire_up(uri));
  return std::unique_ptr<Link>(std::move(link));
}

}  // namespace symrig::board
