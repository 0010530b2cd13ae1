// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/open_rig.hpp"

#include "camera/driver.hpp"
#include "projector/driver.hpp"
#include "rig/sensor_facts.hpp"
#include "symrig/board/link.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

Result<Board> open_board(const RigDescription& file) {
  SYMRIG_TRY(auto link, open_link(file.board));
  BoardOptions options;
  options.keep_alive = file.setup.keep_alive;
  return Board::connect(std::move(link), options);
}

Error wrong_grid(const RigDescription& file, Grid camera) {
  return {ErrorCode::size_mismatch,
          fmt::format("{}: capture.grid is {}, but the camera's region gives {}", file.path,
                      to_string(*file.grid), to_string(camera)),
          "change camera.region or camera.binning, or remove capture.grid"};
}

}  // namespace

RigDevices devices_of(const RigDescription& file) {
  RigDevices devices;
  devices.board = [file] { return open_board(file); };
  // Without a registration, patterns have the camera's grid, which is known only after the camera was opened.
  const auto grid = std::make_shared<std::optional<Grid>>(file.grid);
  devices.camera = [file, grid]() -> Result<std::unique_ptr<Camera>> {
    SYMRIG_TRY(auto camera, file.camera.source->open(sensor_facts(file)));
    if (!file.registration.empty()) return camera;
    if (file.grid && *file.grid != camera->grid()) return wrong_grid(file, camera->grid());
    *grid = camera->grid();
    return camera;
  };
  devices.projector = [file, grid]() {
    const projector::ScreenFacts facts{file.projector.placement, file.projector.codes,
                                       file.options.setup.projector.refresh,
                                       std::filesystem::path(file.path).parent_path()};
    return file.projector.source->open(facts, **grid);
  };
  return devices;
}

Result<SensorParts> parts_for_sensor(RigDescription file) {
  const Region region = file.camera.source->region();
  if (region.binning != 1)
    return Error{ErrorCode::bad_argument,
                 fmt::format("{}: camera.binning is {}, but a sensor is measured by single samples",
                             file.path, region.binning),
                 "remove the key, measure the sensor, and put it back"};
  RigDevices devices = devices_of(file);
  return SensorParts{{std::move(devices), std::move(file.options)}, region == Region{}};
}

Result<std::unique_ptr<Rig>> open_rig_file(RigDescription file) {
  RigDevices devices = devices_of(file);
  return Rig::open(std::move(devices), std::move(file.options));
}

}  // namespace symrig
