// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/camera_picture.hpp"
#include "bench-vm/scene/delivery.hpp"
#include "bench-vm/scene/stage.hpp"
#include "bench-vm/scene/truth_log.hpp"
#include "sim/studio.hpp"

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

namespace symrig::bench_vm {

/// How the camera behaves apart from its pixels.
struct CameraHabits {
  Nanoseconds readout{3'000'000};  ///< from the end of an exposure to its frame
  std::int64_t first_frame = 0;    ///< number of the first frame for the noise, which is a function of it
  FaultRates faults;
};

struct DeliveryTally {
  std::uint64_t delivered = 0;
  std::uint64_t not_taken =
      0;                     ///< nobody was streaming, the camera was unplugged or did not follow the pulse
  std::uint64_t faults = 0;  ///< frames that something was done to, the dropped ones included
  Nanoseconds largest_doubt{0};
};

/// Turns exposures into frames of the scene and hands them to the test camera.
class Developer {
 public:
  /// studio and stage must outlive it.
  Developer(const sim::Studio& studio, Stage& stage, CameraPort port, const CameraPicture& picture,
            const CameraHabits& habits, TruthLog log);

  /// Until the stage is stopped.  fails: as CameraPort::deliver, TruthLog::close; bad_format (the host has
  /// set another format than Y12).
  Result<DeliveryTally> run();

 private:
  Result<void> develop(const Exposure& exposure);
  sim::Studio::Light light_of(const ScreenTimeline::Lit& lit);
  Result<void> hand_over(const DeliveredFrame& frame);
  Result<void> move_cable();
  Nanoseconds next_look() const;

  struct KnownLight {
    std::uint64_t number;
    Picture pattern;
    sim::Studio::Light light;
  };

  const sim::Studio& studio_;
  Stage& stage_;
  CameraPort port_;
  CameraPicture picture_;
  CameraHabits habits_;
  TruthLog log_;
  Delivery delivery_;
  std::deque<KnownLight> known_;
  DeliveryTally tally_;
  bool plugged_ = true;
};

}  // namespace symrig::bench_vm
