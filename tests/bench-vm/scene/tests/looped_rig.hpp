// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/screen_reader.hpp"
#include "bench-vm/scene/truth_log.hpp"
#include "sim/image_formation.hpp"
#include "sim/simulated_devices.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/board/link.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/rig/rig.hpp"

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace symrig::bench_vm {

inline constexpr std::int64_t kTickNs = 8;  // board_sim::SimBoard runs at 125 MHz

/// The virtual rig's board, projector and camera, but with the light of the screen's timeline.
class LoopedRig {
 public:
  explicit LoopedRig(const std::string& text)
      : uri_(*parse_scene_uri(text)), bench_(*sim::make_bench(uri_)), formation_(uri_, *bench_.view) {
    board_.attach(raster_);
    board_.attach(shutter_);
  }

  Result<std::unique_ptr<Rig>> open() {
    RigOptions options;
    options.scale = formation_.scale();
    options.headroom = headroom;
    options.exposures = 4;      // the auditor knows photographs by their brackets, as in the jobs' rig files
    options.ledger.guards = 0;  // as in the virtual rig, whose camera loses no frames at its start
    auto projector =
        std::make_unique<sim::SimulatedProjector>(uri_.size, raster_, options.setup.projector.refresh);
    const sim::SimulatedProjector* screen = projector.get();
    sim::SimulatedCameraSpec spec{formation_.camera(), 1,  {},
                                  formation_.noise(),  {}, board_.config().tick_hz};
    auto camera = std::make_unique<sim::SimulatedCamera>(
        spec, shutter_, [this, screen](auto exposures) { return develop(*screen, exposures); });
    SYMRIG_TRY(auto board, Board::connect(make_sim_link(board_)));
    return Rig::open(std::move(board), std::move(projector), std::move(camera), options);
  }

  const sim::ImageFormation& formation() const { return formation_; }
  std::vector<TrueExposure> truth;          ///< of all exposures so far
  double headroom = RigOptions{}.headroom;  ///< of the exposures that a rig chooses
  /// May change the frames of a run before they are delivered.
  std::function<void(std::vector<CameraFrame>&)> tamper = [](std::vector<CameraFrame>&) {};

 private:
  static Nanoseconds time(std::uint64_t tick) {
    return Nanoseconds{static_cast<std::int64_t>(tick) * kTickNs};
  }

  /// The timeline that the screen's watcher would have recorded.
  ScreenTimeline timeline(const sim::SimulatedProjector& screen) const {
    ScreenTimeline timeline;
    for (const auto& change : raster_.changes())
      timeline.change(time(change.tick), std::make_shared<const Image<float>>(
                                             screen.pattern(static_cast<std::size_t>(change.index))));
    return timeline;
  }

  std::vector<CameraFrame> develop(const sim::SimulatedProjector& screen,
                                   std::span<const sim::SimulatedExposure> exposures) {
    const ScreenTimeline shown = timeline(screen);
    std::vector<CameraFrame> frames;
    for (const auto& exposure : exposures) {
      std::vector<sim::ImageFormation::Share> shares;
      const auto lit = shown.during(time(exposure.begin), time(exposure.end));
      shares.reserve(lit.size());
      for (const auto& part : lit)
        shares.push_back({formation_.light_of(*part.pattern, part.number), part.share});
      const Nanoseconds open = time(exposure.end) - time(exposure.begin);
      TrueExposure known{exposure.sequence, open, 0, lit.size() == 1};
      if (known.pure) known.picture = picture_key(*lit.front().pattern);
      truth.push_back(known);
      CameraFrame frame;
      frame.sequence = exposure.sequence;
      frame.raw = formation_.expose(*formation_.during(shares), seconds(open), exposure.sequence);
      frames.push_back(std::move(frame));
    }
    tamper(frames);
    return frames;
  }

  SceneUri uri_;
  sim::Bench bench_;
  sim::ImageFormation formation_;
  board_sim::SimBoard board_;
  board_sim::SimProjector raster_{board_};
  board_sim::SimCamera shutter_{board_};
};

inline Pattern drawn_pattern(Grid grid, std::uint64_t seed) {
  Random random(seed);
  Pattern pattern(grid);
  for (float& value : pattern.values()) value = random.uniform() < 0.5 ? 0.F : 1.F;
  return pattern;
}

}  // namespace symrig::bench_vm
