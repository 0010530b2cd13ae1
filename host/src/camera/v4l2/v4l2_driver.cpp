// SPDX-License-Identifier: Apache-2.0

#include "camera/v4l2/open_node.hpp"
#include "symrig/base/text.hpp"
#include "symrig/camera/camera_info.hpp"
#include "symrig/camera/internal/driver.hpp"
#include "symrig/camera/internal/video_system.hpp"
#include "symrig/camera/v4l2_camera.hpp"
#include "symrig/image/internal/size_text.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

using camera::OpenNode;
using camera::VideoSystem;

FoundCamera found_from(VideoSystem& system, const OpenNode& driver) {
  const auto& identity = driver.identity();
  return {driver.path(), identity.name, identity.driver, identity.bus, system.serial(driver.path()), {}};
}

bool means(const FoundCamera& camera, std::string_view wanted) {
  return camera.path == wanted || camera.serial == wanted || camera.bus == wanted || camera.name == wanted;
}

/// "/dev/video0 (UVC Camera), /dev/video2 (vivid)"
std::string list(const std::vector<FoundCamera>& cameras) {
  std::string text;
  for (const FoundCamera& camera : cameras) {
    text += (text.empty() ? "" : ", ") + camera.path;
    if (!camera.name.empty()) text += " (" + camera.name + ")";
  }
  return text;
}

/// "did you mean 'FLIR'? ", or an empty text.
std::string nearest_camera(const std::vector<FoundCamera>& all, std::string_view wanted) {
  std::vector<std::string_view> names;
  for (const FoundCamera& camera : all)
    for (const std::string* name : {&camera.name, &camera.serial, &camera.bus, &camera.path})
      if (!name->empty()) names.push_back(*name);
  return suggestion(wanted, names);
}

Result<std::string> only_one(const std::vector<FoundCamera>& fitting, const std::vector<FoundCamera>& all,
                             std::string_view wanted) {
  if (fitting.size() == 1) return fitting.front().path;
  if (all.empty())
    return Error{ErrorCode::device_lost, "no camera found", "connect one; `symrig list` shows the cameras"};
  if (fitting.empty())
    return Error{ErrorCode::unknown_name, fmt::format("no camera is called '{}'", wanted),
                 nearest_camera(all, wanted) + "there are " + list(all)};
  return Error{ErrorCode::bad_argument,
               wanted.empty() ? std::string("several cameras found")
                              : fmt::format("several cameras are called '{}'", wanted),
               "choose one by its path: " + list(fitting)};
}

}  // namespace

std::vector<FoundCamera> find_cameras(VideoSystem& system) {
  std::vector<FoundCamera> found;
  for (const std::string& path : system.paths()) {
    auto driver = OpenNode::open(system, path);
    if (!driver)
      found.push_back({path, {}, {}, {}, system.serial(path), driver.error()});
    else if (driver->identity().captures)
      found.push_back(found_from(system, *driver));
  }
  return found;
}

Result<std::string> choose_camera(VideoSystem& system, std::string_view wanted) {
  if (wanted.starts_with('/')) return std::string(wanted);
  const auto all = find_cameras(system);
  std::vector<FoundCamera> fitting;
  std::copy_if(all.begin(), all.end(), std::back_inserter(fitting),
               [&](const FoundCamera& camera) { return wanted.empty() || means(camera, wanted); });
  return only_one(fitting, all, wanted);
}

Result<CameraInfo> look_at_camera(VideoSystem& system, std::string_view wanted) {
  SYMRIG_TRY(const std::string path, choose_camera(system, wanted));
  SYMRIG_TRY(auto driver, OpenNode::open_camera(system, path));
  CameraInfo info{found_from(system, driver), {}, {}};
  SYMRIG_TRY(info.formats, camera::read_capabilities(driver));
  SYMRIG_TRY(info.controls, camera::read_controls(driver));
  return info;
}

}  // namespace symrig

namespace symrig::camera {
namespace {  // the keys of `[camera]` for the V4L2 driver: docs/rig-file.md

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

Result<CameraInfo> look_at_v4l2_camera(std::string_view path) {
  return look_at_camera(linux_video(), path);
}

}  // namespace

CameraDriver v4l2_driver() {
  return {"v4l2",
          "cameras with a kernel driver (/dev/video0)",
          "",
          "/dev/videoN",
          read_v4l2_camera,
          find_v4l2_cameras,
          look_at_v4l2_camera};
}

}  // namespace symrig::camera
