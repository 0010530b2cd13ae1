// SPDX-License-Identifier: Apache-2.0
// The keys of `[camera]` for GenICam cameras: docs/rig-file.md.
#include "camera/genicam/genicam_driver.hpp"

#include "camera/driver_parts.hpp"
#include "camera/genicam/genicam_camera.hpp"

#include <array>
#include <utility>

#include <fmt/format.h>

namespace symrig::camera {
namespace {

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

}  // namespace symrig::camera
