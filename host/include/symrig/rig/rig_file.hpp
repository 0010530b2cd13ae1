// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/link.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/projector/projector.hpp"
#include "symrig/rig/frame_taker.hpp"
#include "symrig/rig/pair_link.hpp"
#include "symrig/rig/pairs.hpp"
#include "symrig/rig/rig.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

namespace camera {
class CameraSource;
}
namespace projector {
class ProjectorSource;
}

/// The camera of a rig: the settings of its driver, and the settings of every camera.
struct CameraEntry {
  std::shared_ptr<const camera::CameraSource> source;  ///< camera and driver
  bool strobe = true;                                  ///< its strobe line is connected to the board
  Nanoseconds max_exposure{30'000'000'000};
  std::string sensor;               ///< a sensor.toml beside the rig file; replaces the sensor's numbers
  int bits = 0;                     ///< significant bits of a sample; 0: all bits of the format
  std::optional<NoiseModel> noise;  ///< of one sample of the sensor
  Image<std::uint8_t> defects;      ///< in the sensor's picture, 1 = defective; empty: none known
};

/// The projector of a rig: the settings of its driver, and the settings of every projector.
struct ProjectorEntry {
  std::shared_ptr<const projector::ProjectorSource> source;  ///< projector and driver
  Placement placement;                                       ///< where patterns lie on its pixels
  bool vsync = true;                                         ///< its vsync is connected to the board
  std::string levels;  ///< path of its measured response, relative to the rig file; empty: none
  CodeTable codes;     ///< from `levels`
};

/// One of several projector-camera pairs that the board fires together.
struct PairEntry {
  /// Where its server is; none: camera and projector are devices of this computer.
  std::optional<PairAddress> address;
  CameraEntry camera;
  ProjectorEntry projector;
  std::string registration;  ///< as RigDescription::registration
};

/// The content of a rig file (docs/rig-file.md): board, lines, camera, projector, and how photographs are
/// taken.
struct RigDescription {
  std::string path;  ///< for error messages
  std::string name;
  DeviceUri board;
  RigSetup setup;  ///< lines and timing, as in a program file
  CameraEntry camera;
  ProjectorEntry projector;
  /// Several pairs in place of `camera` and `projector`, which are then those of the first pair that is here.
  std::vector<PairEntry> pairs;
  ViewLayout pair_layout;    ///< of `pairs`, row by row from the top left one
  std::optional<Grid> grid;  ///< of patterns; none: the grid of the camera's region. Of each pair, if several
  /// The file of a camera whose pixels are not the cells. Empty: they are.
  std::string registration;
  bool colour = false;           ///< three channels from the camera's colour mosaic (RegisteredProbe)
  bool registers_again = false;  ///< a registered rig that has moved is registered again; else it stops
  std::string map;     ///< where `symrig calibrate` stores the pixel map, .exr or .pfm; empty: nowhere
  RigOptions options;  ///< with the connected part of `setup`

  /// The description of one of several pairs as a rig of its own. The pair is a device of this computer.
  RigDescription one_pair(std::size_t pair) const;
  /// All settings that affect photographs, in one line. A capture continues only on a rig with the same
  /// identity.
  std::string identity() const;
};

/// What a rig file is read for.
enum class RigUse : std::uint8_t {
  capture,
  served,    ///< only its camera and projector, for the board of another computer: it needs no [board]
  one_pair,  ///< to calibrate its camera or projector: the file has one pair only
  sensor  ///< to measure the camera's sensor: its noise need not be known, and `camera.sensor` may be missing
};

/// fails: not_found, io; bad_format: "rig.toml:12: key: problem; what is legal"; bad_argument (a board's
/// URI).
Result<RigDescription> read_rig_file(const std::filesystem::path& path, RigUse use = RigUse::capture);
/// The same from text. Paths of profiles are relative to `folder`.
Result<RigDescription> parse_rig_file(std::string_view text, const std::string& name,
                                      const std::filesystem::path& folder, RigUse use = RigUse::capture);

/// Functions that open the devices of a rig file.
RigDevices devices_of(const RigDescription& file);

/// The cells of all pairs of a rig file. needs: file.grid.
PairLayout pair_layout_of(const RigDescription& file);

/// Opens the devices of a rig file, and opens them again after a loss.
/// fails: as Rig::open() and the devices' own open().
Result<std::unique_ptr<Rig>> open_rig_file(RigDescription file);

/// The devices of a rig file that was read with RigUse::sensor.
struct SensorParts {
  RigParts parts;
  bool whole_picture =
      true;  ///< frames show all pixels of the camera's picture, so defects have their places
};
/// fails: bad_argument (frames are binned on this computer: a code is then no sample of the sensor).
Result<SensorParts> parts_for_sensor(RigDescription file);

}  // namespace symrig
