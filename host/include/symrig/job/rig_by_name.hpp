// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/calibration/registered_probe.hpp"
#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/rig/rig.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// True for "sim:…", and for "dense:…" with keys of a simulated rig.
bool is_simulated(const std::string& rig);

/// True for what is neither "sim:…" nor "exec:…" nor "dense:…": the name of a rig file.
bool is_rig_file(const std::string& rig);

/// Checks that a rig file is there. fails: not_found, unknown_name (names the nearest scene).
Result<void> check_rig_exists(const std::string& rig);

/// An open rig.
struct OpenedRig {
  std::unique_ptr<Probe> probe;
  const Rig* rig = nullptr;               ///< inside the probe; none in a rig that is a child process
  std::string noise;                      ///< "off" or "camera"
  RegisteredProbe* registered = nullptr;  ///< the probe, if it uses a registration
  /// require_coaxial() of the registration's parallax; of a matrix: is it symmetric?
  Result<void> coaxial = {};

  /// What the rig found and solved; nothing if it reports none.
  RigTrouble trouble() const;
};

/// The files that opening the rig RIG reads: the rig file and the files that it names, or a matrix.
JobFiles rig_files(const std::string& rig);

/// Called while a rig waits for a device. false: stop waiting. Empty: wait.
using KeepWaiting = std::function<bool()>;

/// Opens the rig RIG as it is: sim:NAME?key=value&…, exec:COMMAND (docs/howto-own-rig.md), dense:FILE
/// (dense_rig.hpp) or a rig file (docs/rig-file.md). Its camera may have pixels of its own. exposures: frames
/// of a photograph; none: as the rig says. A child process takes its own. fails: unknown_name, bad_argument,
/// not_found, bad_format, device errors; and as ExecProbe::open.
Result<OpenedRig> open_bare_rig(const std::string& rig, std::optional<int> exposures,
                                const KeepWaiting& keep_waiting);
/// The same to calibrate it: a rig that plans its exposures takes kUnforeseenExposures.
Result<OpenedRig> open_rig_to_calibrate(const std::string& rig, const KeepWaiting& keep_waiting);

/// The same, with photographs on the projector's cells. It notices if the rig has moved. registration:
/// the file to use; empty: the one that the rig file names, if any. most_seconds: RigOptions.
/// fails: as open_bare_rig, load_registration and RegisteredProbe::make.
Result<OpenedRig> open_rig(const std::string& rig, const std::string& registration,
                           const KeepWaiting& keep_waiting,
                           double most_seconds = std::numeric_limits<double>::infinity());

/// As open_rig, for simulated rigs only. These know the exact transport.
Result<std::unique_ptr<VirtualRig>> open_simulated_rig(const std::string& rig);

/// The scene of a `sim:` rig, without board, camera or noise, as the truth.
/// fails: as open_simulated_rig.
Result<std::shared_ptr<const Scene>> open_truth(const std::string& rig);

/// The scene as a function for evaluate() and for reports. It keeps the scene alive.
TrueTransport truth_of(std::shared_ptr<const Scene> scene);

/// The same function. Each call is one step of `progress`, which may be empty.
TrueTransport told(TrueTransport truth, Progress progress);

/// What went wrong during a capture and was repaired, a line for each; empty: nothing.
std::vector<std::string> repair_lines(const RigTrouble& trouble);

/// The same, and what the rig warns of (rig_warnings()).
std::vector<std::string> trouble_lines(const RigTrouble& trouble);

/// Exposures without a frame, and frames that could not be used.
std::int64_t lost_frames(const FrameCounts& frames);

/// The measurement of a rig's camera: `symrig calibrate --sensor --rig RIG`.
struct SensorJob {
  std::string rig;             ///< sim:… or a rig file
  std::filesystem::path keep;  ///< folder for the frames; empty: they are not kept
  Progress progress;
  KeepWaiting keep_waiting;
};

struct RigSensor {
  MeasuredSensor measured;
  std::int64_t frames = 0;        ///< exposures that the camera made
  double rig_seconds = 0;         ///< on the rig's clock
  bool defects_left_out = false;  ///< the camera's region is a part of its picture, so defects have no place
  RigTrouble trouble;
};

/// Takes frames of the dark and of the flood-lit scene, and measures the sensor from them.
/// fails: bad_argument (a rig that gives photographs, not frames); as parts_for_sensor, FrameTaker::open,
/// take_sensor_frames, SceneTransfer and SensorRecord.
Result<RigSensor> measure_rig_sensor(const SensorJob& job);

/// The sensor.toml that a rig file names; empty: none, or no rig file.
/// fails: as read_rig_file.
Result<std::string> sensor_file_of(const std::string& rig);

}  // namespace symrig
