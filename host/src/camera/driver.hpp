// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/table_reader.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/camera/camera_info.hpp"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::camera {

/// What a rig knows of its camera's sensor, whatever the driver.
struct SensorFacts {
  std::optional<NoiseModel> noise;  ///< of one sample of the sensor
  int bits = 0;                     ///< significant bits of a sample; 0: all of the format
  Image<std::uint8_t> defects;      ///< of the sensor's picture, 1 = never to be trusted; empty: none known
  CameraTiming timing;
};

/// Which camera, and how it is set up: the keys of `[camera]` that a driver has for itself. Immutable.
class CameraSource {
 public:
  CameraSource() = default;
  CameraSource(const CameraSource&) = delete;
  CameraSource& operator=(const CameraSource&) = delete;
  virtual ~CameraSource() = default;

  /// Opens the camera; may be called again after it was lost.  fails: as the driver's camera.
  virtual Result<std::unique_ptr<Camera>> open(const SensorFacts& sensor) const = 0;
  /// Size of the sensor's picture where the file fixes it: defects have to be measured at the same.
  virtual std::optional<Grid> picture() const = 0;
  /// What photographs depend on, in one line. The photograph log compares it: never change an old one's text.
  virtual std::string identity(const SensorFacts& sensor) const = 0;
};

/// A kind of camera: what `[camera] driver = "NAME"` of a rig file chooses.
struct CameraDriver {
  std::string_view name;
  std::string_view about;  ///< one line
  /// Takes its own keys. What is wrong goes to the reader's context.
  std::unique_ptr<CameraSource> (*read)(base::TableReader& table);
  /// The cameras of this kind that are there now.
  std::vector<FoundCamera> (*find)();
};

/// All drivers; the first is the one of a file that names none.
std::span<const CameraDriver> camera_drivers();

}  // namespace symrig::camera
