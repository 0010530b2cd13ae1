// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/open_rig.hpp"

#include "symrig/board/link.hpp"
#include "symrig/camera/v4l2_camera.hpp"
#include "symrig/projector/drm_projector.hpp"
#include "symrig/projector/folder_projector.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

/// Defects of the sensor's picture as pixels of the frames. A sum of binned samples is dead if one of them
/// is; which ones are summed depends on whether the picture is a mosaic, so all of the square count.
Image<std::uint8_t> dead_pixels(const CameraEntry& entry) {
  const Image<std::uint8_t>& defects = entry.defects;
  if (std::ranges::none_of(defects.values(), [](std::uint8_t d) { return d != 0; })) return {};
  const Region region = resolved(defects.grid(), {entry.row, entry.col, entry.region, entry.binning});
  const int each = entry.binning;
  Image<std::uint8_t> dead(Grid{region.size.rows / each, region.size.cols / each});
  const int reach = each > 1 ? 2 : 1;
  for (int row = 0; row < dead.grid().rows; ++row)
    for (int col = 0; col < dead.grid().cols; ++col) {
      const int top = region.row + row / reach * reach * each, left = region.col + col / reach * reach * each;
      for (int y = top; y < std::min(top + reach * each, defects.grid().rows); ++y)
        for (int x = left; x < std::min(left + reach * each, defects.grid().cols); ++x)
          if (defects.at(y, x) != 0) dead.at(row, col) = 1;
    }
  return dead;
}

CameraSettings settings_of(const RigFile& file) {
  const CameraEntry& entry = file.camera;
  const CameraProfile& profile = file.setup.camera;
  CameraSettings settings;
  settings.device = entry.device;
  settings.format = entry.format;
  settings.size = entry.size;
  settings.rate = entry.rate;
  settings.bits = entry.bits;
  settings.justified = entry.high_justified ? Justified::high : Justified::low;
  settings.region = {entry.row, entry.col, entry.region, entry.binning};
  for (const auto& [name, value] : entry.controls) settings.controls.push_back({name, value});
  settings.noise = entry.noise;
  settings.dead = dead_pixels(entry);
  settings.timing = {profile.min_exposure, entry.max_exposure, profile.readout};
  return settings;
}

Placement placement_of(const ProjectorEntry& entry) {
  return {entry.cell, entry.top, entry.left, entry.mirror_rows, entry.mirror_cols};
}

Result<std::unique_ptr<Projector>> open_folder(const RigFile& file, Grid grid) {
  const ProjectorEntry& entry = file.projector;
  FolderProjectorOptions options;
  options.folder = std::filesystem::path(file.path).parent_path() / entry.folder;
  options.screen = entry.screen;
  options.placement = placement_of(entry);
  options.grid = grid;
  options.codes = entry.codes;
  options.refresh_period = file.options.setup.projector.refresh;
  if (!entry.push.empty()) options.push = push_by_command(entry.push);
  SYMRIG_TRY(auto projector, FolderProjector::open(std::move(options)));
  return std::unique_ptr<Projector>(std::move(projector));
}

Result<std::unique_ptr<Projector>> open_screen(const RigFile& file, Grid grid) {
  DrmProjectorOptions options;
  options.connector = file.projector.connector;
  options.mode = file.projector.mode;
  options.placement = placement_of(file.projector);
  options.grid = grid;
  options.codes = file.projector.codes;
  SYMRIG_TRY(auto projector, DrmProjector::open(options));
  return std::unique_ptr<Projector>(std::move(projector));
}

Result<Board> open_board(const RigFile& file) {
  SYMRIG_TRY(auto link, open_link(file.board));
  BoardOptions options;
  options.keep_alive = file.setup.keep_alive;
  return Board::connect(std::move(link), options);
}

Error wrong_grid(const RigFile& file, Grid camera) {
  return {ErrorCode::size_mismatch,
          fmt::format("{}: capture.grid is {}, the camera's region gives {}", file.path,
                      to_string(*file.grid), to_string(camera)),
          "change camera.region or camera.binning, or leave capture.grid out"};
}

}  // namespace

RigDevices devices_of(const RigFile& file) {
  RigDevices devices;
  devices.board = [file] { return open_board(file); };
  // Patterns have the camera's grid: it is known once the camera has been opened.
  const auto grid = std::make_shared<std::optional<Grid>>(file.grid);
  devices.camera = [file, grid]() -> Result<std::unique_ptr<Camera>> {
    SYMRIG_TRY(auto camera, V4l2Camera::open(settings_of(file)));
    if (file.grid && *file.grid != camera->grid()) return wrong_grid(file, camera->grid());
    *grid = camera->grid();
    return std::unique_ptr<Camera>(std::move(camera));
  };
  devices.projector = [file, grid]() -> Result<std::unique_ptr<Projector>> {
    return file.projector.folder.empty() ? open_screen(file, **grid) : open_folder(file, **grid);
  };
  return devices;
}

Result<std::unique_ptr<Rig>> open_rig_file(RigFile file) {
  RigDevices devices = devices_of(file);
  return Rig::open(std::move(devices), std::move(file.options));
}

}  // namespace symrig
