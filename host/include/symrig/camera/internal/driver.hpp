// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/internal/table_reader.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/camera/camera_info.hpp"
#include "symrig/camera/frame_format.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::camera {

/// What a rig knows about its camera's sensor, with any driver.
struct SensorFacts {
  std::optional<NoiseModel> noise;  ///< of one sensor sample
  int bits = 0;                     ///< significant bits of a sample; 0: all bits of the format
  Image<std::uint8_t> defects;      ///< in the sensor's picture, 1 = defective; empty: none known
  CameraTiming timing;
  std::filesystem::path folder;  ///< of the rig file; relative paths of a driver's keys start here
};

/// Selects a camera and its settings: the keys of `[camera]` that belong to one driver. Immutable.
class CameraSource {
 public:
  CameraSource() = default;
  CameraSource(const CameraSource&) = delete;
  CameraSource& operator=(const CameraSource&) = delete;
  virtual ~CameraSource() = default;

  /// Opens the camera. May be called again after device_lost.
  /// fails: as the driver's camera.
  virtual Result<std::unique_ptr<Camera>> open(const SensorFacts& sensor) const = 0;
  /// The picture size if the rig file sets it. Defects must be measured at this size.
  virtual std::optional<Grid> picture() const = 0;
  /// The part of the picture that frames show, and their binning on this computer.
  virtual Region region() const = 0;
  /// All settings that affect photographs, in one line. The photograph log compares this text, so the text of
  /// existing settings must never change.
  virtual std::string identity(const SensorFacts& sensor) const = 0;
};

/// A camera driver: `[camera] driver = "NAME"` in a rig file selects one. Its folder has the function
/// NAME_driver(), which returns this.
struct CameraDriver {
  std::string_view name;
  std::string_view about;   ///< one line
  std::string_view prefix;  ///< with which the paths of its cameras begin: "genicam:"; empty: any path that
                            ///< no other driver has
  std::string_view form;    ///< how a path of its cameras is written, for help: "genicam:ADDRESS"
  /// Reads the driver's own keys. Adds errors to the reader's context.
  std::unique_ptr<CameraSource> (*read)(base::TableReader& table);
  /// The connected cameras of this driver.
  std::vector<FoundCamera> (*find)();
  /// What the camera at this path reports about itself. fails: device_lost, device_refused.
  Result<CameraInfo> (*look)(std::string_view path);
};

/// All drivers. The first is the default.
std::span<const CameraDriver> camera_drivers();

/// Maps the sensor's defects to pixels of the frames. A sum is dead if any of its samples is dead. Which
/// samples are summed depends on the mosaic, so every sample of the square counts. Empty: there are none.
Image<std::uint8_t> dead_pixels(const Image<std::uint8_t>& defects, const Region& of);

/// The key `region` of `[camera]`.
void read_region(base::TableReader& table, Region& region);

}  // namespace symrig::camera
