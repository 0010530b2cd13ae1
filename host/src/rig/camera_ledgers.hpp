// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"
#include "symrig/rig/camera_ledger.hpp"

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// What the ledgers say of the frames of one run.
struct JudgedFrames {
  /// For each exposure: the frame that certainly shows it. Of several cameras: join_frames() of their frames,
  /// none if one of them has none.
  std::vector<std::optional<CameraFrame>> frame;
  FrameCounts counts;   ///< of all cameras
  std::string trouble;  ///< "1 missing, 2 late". Of several cameras: "pair 2: 1 missing"
};

/// One ledger for each camera of a rig. They share the trigger, and so the exposures that the board saw.
class CameraLedgers {
 public:
  CameraLedgers(const LedgerOptions& options, std::size_t cameras)
      : ledgers_(cameras, CameraLedger(options)) {}

  /// As CameraLedger::judge. frames: of all cameras, those of each camera in order of arrival.
  JudgedFrames judge(std::span<const SeenExposure> exposures, std::vector<CameraFrame> frames,
                     const Camera& camera);

  // As those of CameraLedger, for all cameras.
  void restart();
  void doubt();
  bool needs_guards() const;
  int guards_needed() const;

 private:
  std::vector<CameraLedger> ledgers_;
};

}  // namespace symrig
