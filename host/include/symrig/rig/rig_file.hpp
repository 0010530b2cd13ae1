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
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace symrig {

/// `[camera]` of a rig file: which camera, and what of its picture is used.
struct CameraEntry {
  std::string device;  ///< path, serial number, bus or name; empty: the only one there is
  std::string format;  ///< V4L2's name or FourCC; empty: the deepest linear one
  Grid size;           ///< of the driver's picture; {0, 0}: as it is
  double rate = 0;     ///< pictures a second; 0: as it is
  int bits = 0;        ///< significant ones in a 16-bit format; 0: all
  bool high_justified = true;
  int row = 0, col = 0;  ///< corner of the region
  Grid region;           ///< its size; {0, 0}: to the end of the picture
  int binning = 1;
  std::vector<std::pair<std::string, std::string>> controls;  ///< by line of the file
  bool strobe = true;                                         ///< its strobe line is wired to the board
  Nanoseconds max_exposure{30'000'000'000};
  std::string sensor;               ///< a sensor.toml beside the rig file, in place of the sensor's numbers
  std::optional<NoiseModel> noise;  ///< of one sample of the sensor
  Image<std::uint8_t> defects;      ///< of the sensor's picture, 1 = never to be trusted; empty: none known
};

/// `[projector]` of a rig file: which screen, and where patterns lie on it; or a folder for patterns.
struct ProjectorEntry {
  std::string connector;  ///< "HDMI-A-1"; empty: the only one that is plugged in
  std::string mode;       ///< "1920x1080@60"; empty: the preferred one
  int cell = 1, top = 0, left = 0;
  bool mirror_rows = false, mirror_cols = false;
  std::string folder;  ///< patterns go here as pictures, in place of a screen; empty: a screen
  Grid screen;         ///< with a folder: the projector's pixels
  std::string
      push;  ///< with a folder: a shell command that brings the pictures to the projector; may be empty
  bool vsync = true;   ///< its vsync is wired to the board
  std::string levels;  ///< the projector's measured response, from the rig file's folder on; empty: none
  CodeTable codes;     ///< made of it
};

/// A rig as people write it: docs/rig-file.md.
struct RigFile {
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
Result<RigFile> read_rig_file(const std::filesystem::path& path);
/// The same from text. Profiles named by a path are looked for in `folder`.
Result<RigFile> parse_rig_file(std::string_view text, const std::string& name,
                               const std::filesystem::path& folder);

}  // namespace symrig
