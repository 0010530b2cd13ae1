// SPDX-License-Identifier: Apache-2.0

#include "symrig/camera/internal/genicam_camera.hpp"

#include "camera/genicam/set_up.hpp"
#include "camera/genicam/stream.hpp"
#include "symrig/camera/internal/driver.hpp"

#include <array>
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

namespace {  // the keys of `[camera]` for GenICam cameras: docs/rig-file.md

using base::TableReader;
using base::TomlNode;

class GenicamSource final : public CameraSource {
 public:
  explicit GenicamSource(GenicamSettings settings) : settings_(std::move(settings)) {}

  Result<std::unique_ptr<Camera>> open(const SensorFacts& sensor) const override {
    GenicamSettings settings = settings_;
    settings.bits = sensor.bits;
    settings.noise = sensor.noise;
    settings.dead = dead_pixels(sensor.defects, settings.region);
    settings.timing = sensor.timing;
    SYMRIG_TRY(auto camera, GenicamCamera::open(std::move(settings)));
    return std::unique_ptr<Camera>(std::move(camera));
  }

  std::optional<Grid> picture() const override { return {}; }
  Region region() const override { return settings_.region; }

  std::string identity(const SensorFacts& sensor) const override {
    const GenicamSettings& s = settings_;
    std::string text =
        fmt::format("genicam {} {} {}+{}+{}, binning {}, {}, trigger {} {}, exposure {}", s.device, s.format,
                    to_string(s.region.size), s.region.row, s.region.col, s.region.binning,
                    sensor.noise ? sensor.noise->to_string() : "no noise model", s.line, s.activation,
                    s.exposure ? fmt::format("{} ns", s.exposure->count()) : "trigger");
    if (s.camera_binning != 0) text += fmt::format(", camera binning {}", s.camera_binning);
    if (s.overlap) text += ", overlap";
    if (s.gain) text += fmt::format(", gain {}", *s.gain);
    if (s.black_level) text += fmt::format(", black level {}", *s.black_level);
    for (const ControlSetting& feature : s.features)
      text += fmt::format(", {} {}", feature.name, feature.value);
    return text;
  }

 private:
  GenicamSettings settings_;
};

void read_features(TableReader& table, std::vector<ControlSetting>& features) {
  const TomlNode* node = table.find("features");
  if (node == nullptr) return;
  if (node->kind != TomlNode::Kind::table)
    return table.fail("features", "is not a table",
                      "give [camera.features] with a line for each: Gamma = 1.0");
  for (const TomlNode& value : node->children) {
    if (value.kind == TomlNode::Kind::integer) {
      features.push_back({value.key, std::to_string(value.integer)});
    } else if (value.kind == TomlNode::Kind::real) {
      features.push_back({value.key, fmt::format("{}", value.real)});
    } else if (value.kind == TomlNode::Kind::boolean) {
      features.push_back({value.key, value.boolean ? "true" : "false"});
    } else if (value.kind == TomlNode::Kind::text) {
      features.push_back({value.key, value.text});
    } else {
      table.context().fail(value.line, fmt::format("camera.features.{} is {}", value.key, value.kind_text()),
                           "give a number, an entry in quotes, true or false");
    }
  }
}

/// "trigger-width", or a duration.
void read_exposure(TableReader& table, std::optional<Nanoseconds>& exposure) {
  const TomlNode* node = table.find("exposure");
  if (node == nullptr || (node->kind == TomlNode::Kind::text && node->text == "trigger-width")) return;
  Nanoseconds time{};
  if (base::read_duration(*node, table.path_of("exposure"), table.context(), time)) exposure = time;
}

void read_level(TableReader& table, std::string_view key, std::optional<double>& level) {
  double value = 0;
  if (table.read_number(key, value, -1e6, 1e6)) level = value;
}

}  // namespace

std::unique_ptr<CameraSource> read_genicam_camera(TableReader& table) {
  GenicamSettings settings;
  table.read("device", settings.device);
  table.read("format", settings.format);
  constexpr std::array<std::pair<std::string_view, Justified>, 2> kPlaces{
      {{"high", Justified::high}, {"low", Justified::low}}};
  table.read_choice<Justified>("justified", settings.justified, kPlaces);
  read_region(table, settings.region);
  table.read_whole("binning", settings.region.binning, 1, 64);
  table.read_whole("camera_binning", settings.camera_binning, 1, 16);
  table.read("line", settings.line);
  table.read("activation", settings.activation);
  read_exposure(table, settings.exposure);
  table.read("overlap", settings.overlap);
  read_level(table, "gain", settings.gain);
  read_level(table, "black_level", settings.black_level);
  constexpr std::array<std::pair<std::string_view, StampOf>, 3> kStamps{
      {{"none", StampOf::nothing},
       {"exposure-begin", StampOf::exposure_begin},
       {"exposure-end", StampOf::exposure_end}}};
  table.read_choice<StampOf>("stamp", settings.stamp, kStamps);
  table.read("chunks", settings.chunks);
  read_features(table, settings.features);
  return std::make_unique<GenicamSource>(std::move(settings));
}

CameraDriver genicam_driver() {
  return {"genicam",
          "GigE Vision and USB3 Vision cameras",
          kGenicamPath,
          "genicam:ADDRESS",
          read_genicam_camera,
          find_genicam_cameras,
          look_at_genicam_camera};
}

}  // namespace symrig::camera
