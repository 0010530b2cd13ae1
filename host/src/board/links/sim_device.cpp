// SPDX-License-Identifier: Apache-2.0
#include "board/links/links.hpp"
#include "symrig/base/nearest_name.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/boards/sim_peripherals.hpp"

#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace symrig::board {
namespace {

/// A wire from an output to an input.
class Jumper final : public board_sim::Peripheral {
 public:
  Jumper(int from, int to) : from_(from), to_(to) {}
  void outputs_changed(std::uint64_t, std::uint32_t levels, board_sim::SimBoard& board) override {
    board.set_input(to_, ((levels >> from_) & 1U) != 0);
  }
  std::uint64_t next_event() const override { return board_sim::kNever; }
  void on_event(std::uint64_t, board_sim::SimBoard&) override {}

 private:
  int from_, to_;
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
    SYMRIG_TRY(const int from, line(uri.jumper_from, true));
    SYMRIG_TRY(const int to, line(uri.jumper_to, false));
    board_.attach(jumper_.emplace(from, to));
    return {};
  }

  Result<void> send(std::span<const std::uint8_t> bytes) override { return link_->send(bytes); }
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override { return link_->receive(timeout); }
  Nanoseconds now() const override { return link_->now(); }
  SteadyTime opened() const override { return link_->opened(); }

 private:
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
  std::optional<Jumper> jumper_;
  std::unique_ptr<Link> link_;
};

}  // namespace

Result<std::unique_ptr<Link>> open_sim_device(const DeviceUri& uri) {
  auto link = std::make_unique<OwningSimLink>();
  SYMRIG_CHECK(link->wire_up(uri));
  return std::unique_ptr<Link>(std::move(link));
}

}  // namespace symrig::board
