// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/rig/frame_taker.hpp"
#include "symrig/rig/rig_file.hpp"

#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

Result<RigDescription> described(const std::string& rig) {
  SYMRIG_CHECK(check_rig_exists(rig));
  return read_rig_file(rig, RigUse::sensor);
}

Result<SensorParts> parts_of(const SensorJob& job) {
  if (is_simulated(job.rig)) {
    SYMRIG_TRY(RigParts parts, virtual_rig_parts(job.rig));
    return SensorParts{std::move(parts), true};
  }
  if (!is_rig_file(job.rig))
    return Error{ErrorCode::bad_argument,
                 fmt::format("{} gives photographs, but a sensor is measured by frames", job.rig),
                 "give a rig file or sim:NAME, or measure a folder of its frames"};
  SYMRIG_TRY(RigDescription file, described(job.rig));
  file.options.keep_waiting = job.keep_waiting;
  return parts_for_sensor(std::move(file));
}

/// Passes frames to the measurement and to the record.
class Taken {
 public:
  Taken(SceneTransfer& transfer, std::optional<SensorRecord>& record)
      : transfer_(transfer), record_(record) {}

  SceneSink sink() {
    return {[this](const SceneLevel& level) -> Result<void> {
              SYMRIG_CHECK(transfer_.begin(level));
              return record_ ? record_->begin(level) : Result<void>();
            },
            [this](auto first, auto second) -> Result<void> {
              SYMRIG_CHECK(transfer_.add(first, second));
              return record_ ? record_->add(first, second) : Result<void>();
            }};
  }

 private:
  SceneTransfer& transfer_;
  std::optional<SensorRecord>& record_;
};

}  // namespace

Result<std::string> sensor_file_of(const std::string& rig) {
  if (!is_rig_file(rig)) return std::string();
  SYMRIG_TRY(const RigDescription file, described(rig));
  return file.camera.sensor;
}

Result<RigSensor> measure_rig_sensor(const SensorJob& job) {
  SYMRIG_TRY(SensorParts parts, parts_of(job));
  const bool whole_picture = parts.whole_picture;
  SYMRIG_TRY(const auto rig, FrameTaker::open(std::move(parts.parts)));
  std::optional<SensorRecord> record;
  if (!job.keep.empty()) {
    SYMRIG_TRY(record, SensorRecord::make(job.keep, rig->camera_grid(), rig->bits()));
  }
  SceneTransfer transfer(rig->camera_grid(), rig->bits());
  Taken taken(transfer, record);
  SensorFramesOptions options;
  options.progress = job.progress;
  SYMRIG_CHECK(take_sensor_frames(*rig, taken.sink(), options));
  if (record) SYMRIG_CHECK(record->finish());
  RigSensor result;
  SYMRIG_TRY(result.measured, examine_scene(transfer));
  result.frames = rig->frames();
  result.rig_seconds = rig->rig_seconds();
  result.trouble = rig->trouble();
  result.defects_left_out = !whole_picture;
  std::optional<Sensor>& sensor = result.measured.findings.sensor;
  if (result.defects_left_out && sensor) sensor->defects = {};
  return result;
}

}  // namespace symrig
