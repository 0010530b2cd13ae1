// SPDX-License-Identifier: Apache-2.0
#include "symrig/boards/sim_board.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <string>

namespace symrig {
namespace {

/// A device with active-low lines: it sees these lines inverted.
class InvertedLines final : public board_sim::Peripheral {
 public:
  InvertedLines(board_sim::Peripheral& device, std::uint32_t lines) : device_(device), lines_(lines) {}

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, board_sim::SimBoard& board) override {
    device_.outputs_changed(tick, levels ^ lines_, board);
  }
  std::uint64_t next_event() const override { return device_.next_event(); }
  void on_event(std::uint64_t tick, board_sim::SimBoard& board) override { device_.on_event(tick, board); }

 private:
  board_sim::Peripheral& device_;
  std::uint32_t lines_;
};

board_sim::SimProjectorConfig projector_config(const RigWiring& wiring) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  board_sim::SimProjectorConfig config;
  config.trigger_line = wiring.projector;
  config.vsync_line = wiring.vsync;
  const std::int64_t period = wiring.refresh.count();
  if (period > 0)
    config.refresh_hz =
        static_cast<std::uint32_t>(std::clamp<std::int64_t>((kSecond + period / 2) / period, 1, 10'000));
  return config;
}

board_sim::SimCameraConfig camera_config(const RigWiring& wiring) {
  board_sim::SimCameraConfig config;
  config.trigger_line = wiring.camera;
  config.strobe_line = wiring.strobe;
  config.readout_us = static_cast<std::uint64_t>(wiring.readout.count() / 1000);
  return config;
}

std::uint32_t active_low_lines(const RigWiring& wiring, const board_sim::SimBoard& board) {
  std::uint32_t lines = 0;
  for (const std::string& line : wiring.active_low)
    if (const int k = board.line(line); k >= 0) lines |= 1U << static_cast<unsigned>(k);
  return lines;
}

class SimRigLink final : public Link {
 public:
  explicit SimRigLink(const RigWiring& wiring)
      : projector_(board_, projector_config(wiring)),
        camera_(board_, camera_config(wiring)),
        seen_by_projector_(projector_, active_low_lines(wiring, board_)),
        seen_by_camera_(camera_, active_low_lines(wiring, board_)),
        link_(make_sim_link(board_)) {
    board_.attach(seen_by_projector_);
    board_.attach(seen_by_camera_);
  }

  Result<void> send(std::span<const std::uint8_t> bytes) override { return link_->send(bytes); }
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override { return link_->receive(timeout); }
  Nanoseconds now() const override { return link_->now(); }
  SteadyTime opened() const override { return link_->opened(); }

 private:
  board_sim::SimBoard board_;
  board_sim::SimProjector projector_;
  board_sim::SimCamera camera_;
  InvertedLines seen_by_projector_, seen_by_camera_;
  std::unique_ptr<Link> link_;
};

}  // namespace

std::unique_ptr<Link> make_sim_rig(const RigWiring& wiring) {
  return std::make_unique<SimRigLink>(wiring);
}

}  // namespace symrig
