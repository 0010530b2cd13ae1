// SPDX-License-Identifier: Apache-2.0
#include "symrig/camera/v4l2_camera.hpp"

#include "camera/v4l2/open_node.hpp"
#include "camera/v4l2/stream.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig {

using camera::OpenNode;
using camera::PictureLayout;
using camera::Stream;
using camera::VideoSystem;

/// State of an open camera. There is no stream while the camera is lost.
struct V4l2Camera::Inside {
  Inside(CameraSettings wanted, VideoSystem& on) : settings(std::move(wanted)), system(&on) {}

  Result<void> start(const std::string& path);
  Result<OpenNode> prepare(const std::string& path, PictureLayout& picture);
  Result<void> check(const PictureLayout& picture) const;
  NoiseModel sample_noise(int bits) const;
  /// Closes the node. The kernel can then give the same number to the returning camera.
  void close();
  Result<std::string> path_now() const;
  void remark(const std::string& line);
  Error lost_error() const {
    return lost.value_or(
        Error{ErrorCode::device_lost, fmt::format("camera {} is closed", found.path), "reopen it"});
  }

  CameraSettings settings;
  VideoSystem* system;
  FoundCamera found;
  PictureLayout layout;
  BinnedGrid binned_to;
  std::optional<NoiseModel> noise;
  camera::SequenceCount counts;
  StreamReport report;
  std::optional<Error> lost;
  std::unique_ptr<Stream> stream;
};

NoiseModel V4l2Camera::Inside::sample_noise(int bits) const {
  if (settings.noise) return *settings.noise;
  return NoiseModel::from_variance_line({.offset = 1.0 / 12, .slope = 1, .bits = bits, .pedestal = 0});
}

/// Checks the settings against the picture that the camera gives.
Result<void> V4l2Camera::Inside::check(const PictureLayout& picture) const {
  SYMRIG_TRY(const BinnedGrid to, binned_grid(picture.size, picture.format->mosaic, settings.region));
  if (settings.buffers < 2 || settings.buffers > 32)
    return Error{ErrorCode::bad_argument, fmt::format("{} buffers is out of range", settings.buffers),
                 "2 to 32"};
  if (settings.waiting < 1)
    return Error{ErrorCode::bad_argument, "a queue of 0 frames holds nothing", "give at least 1"};
  if (settings.noise && !settings.noise->valid())
    return Error{ErrorCode::bad_argument, "the camera's noise model is wrong: " + settings.noise->to_string(),
                 "correct its numbers"};
  if (settings.noise && settings.noise->bits() != picture.depth.bits)
    return Error{ErrorCode::bad_argument,
                 fmt::format("the camera's noise model has {} bits, but {} has {}", settings.noise->bits(),
                             picture.format->name, picture.depth.bits),
                 "give the noise model of a single sample in this format"};
  if (!settings.dead.empty() && settings.dead.grid() != to.grid)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the map of dead pixels is {}, frames are {}", to_string(settings.dead.grid()),
                             to_string(to.grid)),
                 "make the map for the region and binning in use"};
  return {};
}

/// Adds a note about the settings once, even if the stream restarts.
void V4l2Camera::Inside::remark(const std::string& line) {
  auto& notes = report.notes;
  if (std::find(notes.begin(), notes.end(), line) == notes.end()) notes.push_back(line);
}

Result<OpenNode> V4l2Camera::Inside::prepare(const std::string& path, PictureLayout& picture) {
  SYMRIG_TRY(auto driver, OpenNode::open_camera(*system, path));
  SYMRIG_TRY(picture, camera::negotiate(driver, settings));
  SYMRIG_CHECK(check(picture));
  for (const ControlSetting& setting : settings.controls) {
    SYMRIG_TRY(const ControlInfo control, camera::find_control(driver, setting.name));
    SYMRIG_TRY(const std::int64_t value, camera::control_value(control, setting.value));
    SYMRIG_CHECK(camera::set_control(driver, control, value));
  }
  return driver;
}

Result<void> V4l2Camera::Inside::start(const std::string& path) {
  SYMRIG_TRY(auto driver, prepare(path, layout));
  const auto& identity = driver.identity();
  found = {path, identity.name, identity.driver, identity.bus, system->serial(path), {}};
  const NoiseModel sample = sample_noise(layout.depth.bits);
  SYMRIG_TRY(binned_to, binned_grid(layout.size, layout.format->mosaic, settings.region));
  noise = binned(sample, settings.region.binning);
  if (!settings.noise) remark("no noise model was given: codes count as electrons; do not measure with them");
  if (!layout.format->linear)
    remark(fmt::format("the codes of {} are not linear in light", layout.format->name));
  SYMRIG_TRY(stream, Stream::start(std::move(driver),
                                   {layout, settings.region, sample.saturation_code(), settings.buffers,
                                    settings.waiting},
                                   counts, report));
  lost.reset();
  return {};
}

void V4l2Camera::Inside::close() {
  if (!stream) return;
  counts = stream->finish();
  counts.restart();
  report = stream->report();
  stream.reset();
}

/// The camera's current path: same bus and name, and same serial number if it has one.
Result<std::string> V4l2Camera::Inside::path_now() const {
  std::string elsewhere;
  for (const FoundCamera& camera : find_cameras(*system)) {
    const bool same = camera.bus == found.bus && camera.name == found.name && camera.serial == found.serial;
    if (same && camera.path == found.path) return camera.path;
    // It may be in another socket if the serial number identifies it.
    if (same || (!found.serial.empty() && camera.serial == found.serial && camera.name == found.name))
      elsewhere = camera.path;
  }
  if (!elsewhere.empty()) return elsewhere;
  return Error{ErrorCode::device_lost, fmt::format("camera {} ({}) is not back", found.path, found.name),
               "connect it again"};
}

V4l2Camera::V4l2Camera(std::unique_ptr<Inside> inside) : inside_(std::move(inside)) {}
V4l2Camera::~V4l2Camera() = default;

Result<std::unique_ptr<V4l2Camera>> V4l2Camera::open(CameraSettings settings) {
  return open(std::move(settings), camera::linux_video());
}

Result<std::unique_ptr<V4l2Camera>> V4l2Camera::open(CameraSettings settings, VideoSystem& system) {
  SYMRIG_TRY(const std::string path, choose_camera(system, settings.device));
  auto inside = std::make_unique<Inside>(std::move(settings), system);
  if (!inside->settings.noise)
    inside->report.notes.emplace_back(
        "no noise model was given: codes count as electrons; do not measure with them");
  SYMRIG_CHECK(inside->start(path));
  if (!inside->layout.format->linear)
    inside->report.notes.push_back(
        fmt::format("the codes of {} are not linear in light", inside->layout.format->name));
  return std::unique_ptr<V4l2Camera>(new V4l2Camera(std::move(inside)));
}

Grid V4l2Camera::grid() const {
  return inside_->binned_to.grid;
}
CameraTiming V4l2Camera::timing() const {
  return inside_->settings.timing;
}
const NoiseModel& V4l2Camera::noise() const {
  return *inside_->noise;
}
const Image<std::uint8_t>* V4l2Camera::dead() const {
  return inside_->settings.dead.empty() ? nullptr : &inside_->settings.dead;
}
Mosaic V4l2Camera::mosaic() const {
  return inside_->binned_to.mosaic;
}
const PixelFormat& V4l2Camera::format() const {
  return *inside_->layout.format;
}
const FoundCamera& V4l2Camera::found() const {
  return inside_->found;
}
StreamReport V4l2Camera::report() const {
  return inside_->stream ? inside_->stream->report() : inside_->report;
}

Result<std::vector<CameraFrame>> V4l2Camera::take(std::size_t count, Nanoseconds patience) {
  if (!inside_->stream) return inside_->lost_error();
  auto frames = inside_->stream->take(count, patience);
  if (!frames) {
    inside_->lost = frames.error();
    inside_->close();
  }
  return frames;
}

std::string V4l2Camera::describe() const {
  const PictureLayout& layout = inside_->layout;
  std::string text = fmt::format("{} {} from {} ({})", layout.format->name, to_string(layout.size),
                                 inside_->found.path, inside_->found.name);
  const int k = inside_->settings.region.binning;
  if (k > 1)
    text += fmt::format(", {} bins of {}x{}", to_string(grid()), k, k);
  else if (grid() != layout.size)
    text += fmt::format(", {} of it", to_string(grid()));
  return text;
}

Result<void> V4l2Camera::set_control(std::string_view name, std::string_view value) {
  if (!inside_->stream) return inside_->lost_error();
  OpenNode& driver = inside_->stream->driver();
  SYMRIG_TRY(const ControlInfo control, camera::find_control(driver, name));
  SYMRIG_TRY(const std::int64_t number, camera::control_value(control, value));
  return camera::set_control(driver, control, number);
}

Result<std::int64_t> V4l2Camera::control(std::string_view name) {
  if (!inside_->stream) return inside_->lost_error();
  OpenNode& driver = inside_->stream->driver();
  SYMRIG_TRY(const ControlInfo control, camera::find_control(driver, name));
  return camera::get_control(driver, control);
}

Result<void> V4l2Camera::reopen() {
  inside_->close();
  SYMRIG_TRY(const std::string path, inside_->path_now());
  ++inside_->report.restarts;
  return inside_->start(path);
}

}  // namespace symrig
