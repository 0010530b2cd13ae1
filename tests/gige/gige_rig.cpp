// SPDX-License-Identifier: Apache-2.0
#include "gige/gige_rig.hpp"

#include "symrig/board/board_info.hpp"
#include "symrig/board/link.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/camera/internal/genicam_camera.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig::gige {
namespace {

constexpr int kBits = 12;  // of the simulated sensor
constexpr const char* kTrigger = "camera_trigger";

/// The camera that a rig file's keys name, opened with what the rig knows of its sensor.
Result<std::unique_ptr<Camera>> camera_of(const std::string& keys, const camera::SensorFacts& facts) {
  SYMRIG_TRY(const base::TomlNode document, base::parse_toml(keys, "rig.toml"));
  base::ReadContext context{"rig.toml"};
  base::TableReader table(document, "camera", context);
  const auto source = camera::read_genicam_camera(table);
  table.finish();
  if (!context.state) return context.state.error();
  return source->open(facts);
}

}  // namespace

GigeRig::GigeRig(CameraTraits traits, std::string keys)
    : keys_(std::move(keys)),
      device_(std::move(traits), [this](const Shot& /*shot*/, std::span<std::uint16_t> codes) {
        const std::size_t count = std::min(codes.size(), picture_.raw.size());
        for (std::size_t k = 0; k < count; ++k)
          codes[k] = static_cast<std::uint16_t>(picture_.raw[k] << (16 - kBits));
      }) {}

VirtualRigHooks GigeRig::hooks(bool knows_noise) {
  VirtualRigHooks hooks;
  hooks.camera = [this, knows_noise](Camera& simulated) { return open_camera(simulated, knows_noise); };
  hooks.board = [this](board_sim::SimBoard& board) {
    if (std::exchange(board_, &board) == nullptr) board.attach(*this);
    return Board::connect(make_sim_link(board));
  };
  hooks.shutter = [this](board_sim::SimCamera& shutter) { shutter_ = &shutter; };
  hooks.options = [this](RigOptions& set) {
    set.ledger.guards = 4;  // as a rig file's default
    if (options) options(set);
  };
  return hooks;
}

Result<std::unique_ptr<VirtualRig>> GigeRig::open(const std::string& uri) {
  return open_virtual_rig(uri, hooks(true));
}

Result<RigParts> GigeRig::parts(const std::string& uri) {
  return virtual_rig_parts(uri, hooks(false));
}

Result<std::unique_ptr<Camera>> GigeRig::open_camera(Camera& simulated, bool knows_noise) {
  simulated_ = &simulated;
  const std::string keys = fmt::format("device = \"{}\"\nformat = \"Mono12\"\nstamp = \"exposure-end\"\n{}",
                                       device_.address(), keys_);
  camera::SensorFacts facts;
  if (knows_noise) facts.noise = noise.value_or(simulated.noise());
  facts.bits = kBits;
  facts.timing = simulated.timing();
  SYMRIG_TRY(auto camera, camera_of(keys, facts));
  obey_nodes();
  return camera;
}

/// The shutter's trigger is as the camera's nodes TriggerDelay and TriggerOverlap say.
void GigeRig::obey_nodes() {
  constexpr std::uint32_t kDelay = 0x10034, kOverlap = 0x10088;
  const std::uint64_t delay_us = device_.reg(kDelay) / 1000;
  delay_ = delay_us * board_->config().tick_hz / 1'000'000;
  shutter_->set_trigger(delay_us, device_.reg(kOverlap) == 1, *board_);
}

/// The simulated shutter is on the same line and was attached before, so its exposure has ended too.
void GigeRig::outputs_changed(std::uint64_t tick, std::uint32_t levels, board_sim::SimBoard& board) {
  const int line = board.line(kTrigger);
  const bool high = line >= 0 && ((levels >> static_cast<unsigned>(line)) & 1U) != 0;
  if (high == std::exchange(high_, high)) return;
  const TickRate rate{board.config().tick_hz};
  if (high) begin_ = tick;
  if (high && end_ != 0) shortest_gap_ = std::min(shortest_gap_, rate.nanoseconds({tick - end_}));
  if (high) return;
  end_ = tick;
  waiting_.push_back({begin_, tick});
  if (delay_ == 0) on_event(tick, board);
}

void GigeRig::on_event(std::uint64_t tick, board_sim::SimBoard& board) {
  if (next_event() > tick) return;
  const Pulse pulse = waiting_.front();
  waiting_.pop_front();
  if (simulated_ != nullptr) expose(pulse.end - pulse.begin, tick, board.config().tick_hz);
}

void GigeRig::expose(std::uint64_t width, std::uint64_t end, std::uint64_t tick_hz) {
  auto frames = simulated_->take(1, Nanoseconds{0});
  if (!frames || frames->empty()) return;  // the shutter was busy and missed the trigger
  picture_ = std::move(frames->front());
  const TickRate rate{tick_hz};
  ++pulses_;
  device_.pulse(rate.nanoseconds({width}), mishap ? mishap() : Mishap::none, rate.nanoseconds({end}));
}

}  // namespace symrig::gige
