// SPDX-License-Identifier: Apache-2.0
#include "camera/genicam/genicam_camera.hpp"

#include "camera/genicam/find.hpp"
#include "camera/genicam/stream.hpp"

#include <utility>

#include <fmt/format.h>

namespace symrig::camera {

struct GenicamCamera::Inside {
  GenicamSettings settings;
  OpenDevice open;
  PictureLayout layout;
  BinnedGrid binned_to;
  std::optional<NoiseModel> noise;
  CameraTiming timing;
  std::unique_ptr<GenicamStream> stream;  // after the device, so that it ends first

  NoiseModel sample_noise() const {
    if (settings.noise) return *settings.noise;
    return NoiseModel::from_variance_line(
        {.offset = 1.0 / 12, .slope = 1, .bits = layout.depth.bits, .pedestal = 0});
  }
  Result<void> check() const;
  Result<void> start();
};

Result<void> GenicamCamera::Inside::check() const {
  if (settings.noise && (!settings.noise->valid() || settings.noise->bits() != layout.depth.bits))
    return Error{ErrorCode::bad_argument,
                 fmt::format("the camera's noise model does not fit {} of {} bits: {}", layout.format->name,
                             layout.depth.bits, settings.noise->to_string()),
                 "give the noise model of a single sample in this format"};
  if (!settings.dead.empty() && settings.dead.grid() != binned_to.grid)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the map of dead pixels is {}, frames are {}", to_string(settings.dead.grid()),
                             to_string(binned_to.grid)),
                 "make the map for the region and binning in use"};
  if (settings.buffers < 2 || settings.waiting < 1)
    return Error{ErrorCode::bad_argument, "a camera needs 2 buffers and a queue of 1 frame", "give more"};
  return {};
}

Result<void> GenicamCamera::Inside::start() {
  Features features(open.device.get(), open.found.path);
  SYMRIG_TRY(layout, set_up(features, settings));
  SYMRIG_TRY(const ChunkNames chunks, set_chunks(features, settings.chunks));
  SYMRIG_TRY(binned_to, binned_grid(layout.size, layout.format->mosaic, {0, 0, {}, settings.region.binning}));
  SYMRIG_CHECK(check());
  timing = camera_timing(features, settings.overlap, settings.timing);
  const NoiseModel sample = sample_noise();
  noise = binned(sample, settings.region.binning);
  StreamReport report;
  if (!settings.noise)
    report.notes.emplace_back("no noise model was given: codes count as electrons; do not measure with them");
  SYMRIG_TRY(stream, GenicamStream::start(open.device.get(),
                                          {layout, settings.region.binning, sample.saturation_code(),
                                           settings.buffers, settings.waiting, settings.socket_limit,
                                           !settings.line.empty(), settings.stamp, chunks, open.found.path},
                                          std::move(report)));
  return {};
}

GenicamCamera::GenicamCamera(std::unique_ptr<Inside> inside) : inside_(std::move(inside)) {}
GenicamCamera::~GenicamCamera() = default;

Result<std::unique_ptr<GenicamCamera>> GenicamCamera::open(GenicamSettings settings) {
  auto inside = std::make_unique<Inside>();
  inside->settings = std::move(settings);
  SYMRIG_TRY(inside->open, open_device(inside->settings.device));
  SYMRIG_CHECK(inside->start());
  return std::unique_ptr<GenicamCamera>(new GenicamCamera(std::move(inside)));
}

Grid GenicamCamera::grid() const {
  return inside_->binned_to.grid;
}
CameraTiming GenicamCamera::timing() const {
  return inside_->timing;
}
const NoiseModel& GenicamCamera::noise() const {
  return *inside_->noise;
}
const Image<std::uint8_t>* GenicamCamera::dead() const {
  return inside_->settings.dead.empty() ? nullptr : &inside_->settings.dead;
}
Mosaic GenicamCamera::mosaic() const {
  return inside_->binned_to.mosaic;
}
const FoundCamera& GenicamCamera::found() const {
  return inside_->open.found;
}
StreamReport GenicamCamera::report() const {
  return inside_->stream->report();
}

Result<std::vector<CameraFrame>> GenicamCamera::take(std::size_t count, Nanoseconds patience) {
  return inside_->stream->take(count, patience);
}

std::string GenicamCamera::describe() const {
  std::string text = fmt::format("{} {} from {} ({})", inside_->layout.format->name,
                                 to_string(inside_->layout.size), found().path, found().name);
  const int k = inside_->settings.region.binning;
  return k == 1 ? text : text + fmt::format(", {} bins of {}x{}", to_string(grid()), k, k);
}

}  // namespace symrig::camera
