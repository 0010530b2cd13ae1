// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/delivery.hpp"
#include "bench-vm/scene/scene_camera.hpp"
#include "bench-vm/scene/stage.hpp"
#include "bench-vm/scene/truth_log.hpp"
#include "sim/image_formation.hpp"

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

namespace symrig::bench_vm {

/// The camera's behaviour other than its pixels.
struct CameraHabits {
  Nanoseconds readout{3'000'000};  ///< from the end of an exposure to its frame
  std::int64_t first_frame = 0;    ///< number of the first frame, which selects its noise
  FaultRates faults;
};

struct DeliveryTally {
  std::uint64_t delivered = 0;
  std::uint64_t not_taken = 0;  ///< not streaming, camera unplugged, or camera not in pulse mode
  std::uint64_t faults = 0;     ///< frames with a fault, including dropped ones
  Nanoseconds largest_doubt{0};
};

/// Makes the frames of exposures and delivers them to the camera.
class Developer {
 public:
  /// formation, stage and camera must outlive it.
  Developer(const sim::ImageFormation& formation, Stage& stage, SceneCamera& camera,
            const CameraHabits& habits, TruthLog log);

  /// Runs until the stage is stopped.
  /// fails: as SceneCamera::settings, SceneCamera::deliver, TruthLog::close.
  Result<DeliveryTally> run();

 private:
  Result<void> develop(const Exposure& exposure);
  sim::ImageFormation::Light light_of(const ScreenTimeline::Lit& lit);
  Result<void> hand_over(const DeliveredFrame& frame);
  Result<void> move_cable();
  Nanoseconds next_look() const;

  struct KnownLight {
    std::uint64_t number;
    Picture pattern;
    sim::ImageFormation::Light light;
  };

  const sim::ImageFormation& formation_;
  Stage& stage_;
  SceneCamera& camera_;
  CameraHabits habits_;
  TruthLog log_;
  Delivery delivery_;
  std::deque<KnownLight> known_;
  DeliveryTally tally_;
  bool plugged_ = true;
};

}  // namespace symrig::bench_vm
