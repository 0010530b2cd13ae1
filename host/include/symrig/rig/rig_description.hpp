// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/device_uri.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/projector/placement.hpp"
#include "symrig/rig/rig.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace symrig {

namespace camera {
class CameraSource;
}
namespace projector {
class ProjectorSource;
}

/// The camera of a rig: its driver's own settings, and what any camera needs.
struct CameraEntry {
  std::shared_ptr<const camera::CameraSource> source;  ///< which camera, by which driver
  bool strobe = true;                                  ///< its strobe line is wired to the board
  Nanoseconds max_exposure{30'000'000'000};
  std::string sensor;               ///< a sensor.toml beside the rig file, in place of the sensor's numbers
  int bits = 0;                     ///< significant ones of a sample; 0: all of the format
  std::optional<NoiseModel> noise;  ///< of one sample of the sensor
  Image<std::uint8_t> defects;      ///< of the sensor's picture, 1 = never to be trusted; empty: none known
};

/// The projector of a rig: its driver's own settings, and what any projector needs.
struct ProjectorEntry {
  std::shared_ptr<const projector::ProjectorSource> source;  ///< which projector, by which driver
  Placement placement;                                       ///< of patterns on its pixels
  bool vsync = true;                                         ///< its vsync is wired to the board
  std::string levels;  ///< the projector's measured response, from the rig file's folder on; empty: none
  CodeTable codes;     ///< made of it
};

/// A rig as people write it (docs/rig-file.md): board, lines, camera, projector, and how photographs are
/// taken.
struct RigDescription {
  std::string path;  ///< for messages
  std::string name;
  DeviceUri board;
  RigSetup setup;  ///< lines and timing, as in a program file
  CameraEntry camera;
  ProjectorEntry projector;
  std::optional<Grid> grid;  ///< of patterns and photographs; none: what the camera's region has
  std::string map;           ///< where `symrig calibrate` keeps the pixel map, .exr or .pfm; empty: nowhere
  RigOptions options;        ///< with what of `setup` is wired

  /// What photographs depend on, in one line: a capture is continued only on a rig with the same.
  std::string identity() const;
};

/// fails: not_found, io; bad_format: "rig.toml:12: key: what; what is legal"; bad_argument (a board's URI).
Result<RigDescription> read_rig_file(const std::filesystem::path& path);
/// The same from text. Profiles named by a path are looked for in `folder`.
Result<RigDescription> parse_rig_file(std::string_view text, const std::string& name,
                                      const std::filesystem::path& folder);

}  // namespace symrig
