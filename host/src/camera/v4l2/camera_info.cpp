// SPDX-License-Identifier: Apache-2.0
#include "symrig/camera/camera_info.hpp"

#include "camera/v4l2/controls.hpp"
#include "camera/v4l2/formats.hpp"
#include "camera/v4l2/open_node.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>

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
