// SPDX-License-Identifier: Apache-2.0
#include "rig/rig_file_keys.hpp"
#include "symrig/board/link.hpp"
#include "symrig/camera/internal/driver.hpp"
#include "symrig/projector/internal/driver.hpp"
#include "symrig/rig/internal/each_pair.hpp"
#include "symrig/rig/pair_link.hpp"
#include "symrig/rig/rig_file.hpp"

#include <algorithm>
#include <utility>
#include <vector>

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

namespace {

/// The devices of all pairs, opened together. The board is one.
RigDevices devices_of_pairs(const RigDescription& file) {
  std::vector<RigDevices> each;
  const PairLayout layout = pair_layout_of(file);
  for (std::size_t k = 0; k < file.pairs.size(); ++k) {
    const auto& address = file.pairs[k].address;
    each.push_back(
        address ? linked_devices(*address, layout.layout, k, layout.tile(k).grid, file.options.keep_waiting)
                : devices_of(file.one_pair(k)));
  }
  RigDevices devices;
  devices.board = [file] { return open_board(file); };
  devices.camera = [each, layout]() -> Result<std::unique_ptr<Camera>> {
    std::vector<std::unique_ptr<Camera>> cameras(each.size());
    SYMRIG_CHECK(rig::for_each_pair(each.size(), [&](std::size_t k) -> Result<void> {
      SYMRIG_TRY(cameras[k], each[k].camera());
      return {};
    }));
    return join_cameras(std::move(cameras), layout);
  };
  devices.projector = [each, layout]() -> Result<std::unique_ptr<Projector>> {
    std::vector<std::unique_ptr<Projector>> projectors(each.size());
    SYMRIG_CHECK(rig::for_each_pair(each.size(), [&](std::size_t k) -> Result<void> {
      SYMRIG_TRY(projectors[k], each[k].projector());
      return {};
    }));
    return join_projectors(std::move(projectors), layout);
  };
  return devices;
}

}  // namespace

PairLayout pair_layout_of(const RigDescription& file) {
  const Grid one = file.grid.value_or(Grid{});
  return {file.pair_layout, {one.rows * file.pair_layout.rows, one.cols * file.pair_layout.cols}};
}

RigDevices devices_of(const RigDescription& file) {
  if (!file.pairs.empty()) return devices_of_pairs(file);
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
