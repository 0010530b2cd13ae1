// SPDX-License-Identifier: Apache-2.0
// The keys of `[camera]` for the V4L2 driver: docs/rig-file.md.
#include "camera/v4l2/v4l2_driver.hpp"

#include "camera/driver_parts.hpp"
#include "camera/v4l2/video_system.hpp"
#include "image/size_text.hpp"
#include "symrig/camera/v4l2_camera.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

namespace symrig::camera {
namespace {

using base::TableReader;
using base::TomlNode;

class V4l2Source final : public CameraSource {
 public:
  explicit V4l2Source(CameraSettings settings) : settings_(std::move(settings)) {}

  Result<std::unique_ptr<Camera>> open(const SensorFacts& sensor) const override {
    CameraSettings settings = settings_;
    settings.bits = sensor.bits;
    settings.noise = sensor.noise;
    settings.dead = dead_pixels(sensor.defects, settings_.region);
    settings.timing = sensor.timing;
    SYMRIG_TRY(auto camera, V4l2Camera::open(std::move(settings)));
    return std::unique_ptr<Camera>(std::move(camera));
  }

  std::optional<Grid> picture() const override {
    if (!settings_.size.valid()) return {};
    return settings_.size;
  }

  Region region() const override { return settings_.region; }

  std::string identity(const SensorFacts& sensor) const override {
    const CameraSettings& s = settings_;
    std::string text =
        fmt::format("camera {} {} {}+{}+{} of {}, binning {}, {}", s.device, s.format,
                    to_string(s.region.size), s.region.row, s.region.col, to_string(s.size), s.region.binning,
                    sensor.noise ? sensor.noise->to_string() : "no noise model");
    for (const ControlSetting& control : s.controls)
      text += fmt::format(", {} {}", control.name, control.value);
    return text;
  }

 private:
  CameraSettings settings_;
};

/// Values of the camera's controls, as text: numbers, menu entries, on or off.
void read_controls(TableReader& table, std::vector<ControlSetting>& controls) {
  const TomlNode* node = table.find("controls");
  if (node == nullptr) return;
  if (node->kind != TomlNode::Kind::table)
    return table.fail("controls", "is not a table", "give { gain = 10, trigger_mode = \"External Edge\" }");
  for (const TomlNode& value : node->children) {
    if (value.kind == TomlNode::Kind::integer) {
      controls.push_back({value.key, std::to_string(value.integer)});
    } else if (value.kind == TomlNode::Kind::boolean) {
      controls.push_back({value.key, value.boolean ? "1" : "0"});
    } else if (value.kind == TomlNode::Kind::text) {
      controls.push_back({value.key, value.text});
    } else {
      table.context().fail(value.line, fmt::format("camera.controls.{} is {}", value.key, value.kind_text()),
                           "give a whole number, a menu entry in quotes, true or false");
    }
  }
}

}  // namespace

std::unique_ptr<CameraSource> read_v4l2_camera(TableReader& table) {
  CameraSettings settings;
  table.read("device", settings.device);
  table.read("format", settings.format);
  image::read_picture_size(table, "size", settings.size);
  table.read_number("rate", settings.rate, 0.001, 1e6);
  constexpr std::array<std::pair<std::string_view, Justified>, 2> kJustified{
      {{"high", Justified::high}, {"low", Justified::low}}};
  table.read_choice<Justified>("justified", settings.justified, kJustified);
  read_region(table, settings.region);
  table.read_whole("binning", settings.region.binning, 1, 64);
  read_controls(table, settings.controls);
  return std::make_unique<V4l2Source>(std::move(settings));
}

std::vector<FoundCamera> find_v4l2_cameras() {
  return find_cameras(linux_video());
}

}  // namespace symrig::camera
