// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/hdr/scene_sensor.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace symrig {

/// Writes the frames of a sensor's measurement to a folder, with the capture.toml that measures the same
/// again (measure_sensor_folder). That file comes last, so a record that was stopped is none.
class SensorRecord {
 public:
  /// Its first level makes the folder, if only it is missing.
  /// fails: bad_argument (the folder has a capture.toml, which may describe other photographs).
  static Result<SensorRecord> make(std::filesystem::path folder, Grid grid, int bits);

  /// As SceneTransfer::begin() and add(). fails: io, and as write_file_atomically().
  Result<void> begin(const SceneLevel& level);
  Result<void> add(std::span<const std::uint16_t> first, std::span<const std::uint16_t> second);
  Result<void> finish();

 private:
  SensorRecord(std::filesystem::path folder, std::string head)
      : folder_(std::move(folder)), text_(std::move(head)) {}
  Result<void> add(std::span<const std::uint16_t> codes);
  void end_level();

  std::filesystem::path folder_;
  std::string text_;   // of capture.toml
  std::string files_;  // of the level
  std::string name_;   // "lit3"
  int levels_ = 0, frames_ = 0;
};

}  // namespace symrig
