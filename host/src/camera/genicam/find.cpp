// SPDX-License-Identifier: Apache-2.0
#include "camera/genicam/find.hpp"

#include "camera/genicam/features.hpp"
#include "camera/genicam/genicam_driver.hpp"
#include "camera/pfnc.hpp"

#include <algorithm>
#include <mutex>

#include <arpa/inet.h>
#include <fmt/format.h>

namespace symrig::camera {
namespace {

// Aravis has one list of cameras for the whole program.
std::mutex& list_mutex() {
  static std::mutex mutex;
  return mutex;
}

/// Aravis 0.8.26 joins a thread that it never started if a USB3 camera cannot be opened, and GLib prints
/// that.
class WithoutComplaints {
 public:
  WithoutComplaints() : handler_(g_log_set_handler("GLib", G_LOG_LEVEL_CRITICAL, ignore, nullptr)) {}
  WithoutComplaints(const WithoutComplaints&) = delete;
  WithoutComplaints& operator=(const WithoutComplaints&) = delete;
  ~WithoutComplaints() { g_log_remove_handler("GLib", handler_); }

 private:
  static void ignore(const gchar* /*domain*/, GLogLevelFlags /*level*/, const gchar* /*message*/,
                     gpointer /*data*/) {}
  guint handler_;
};

std::string text(const char* words) {
  return words == nullptr ? std::string() : std::string(words);
}

bool is_address(std::string_view wanted) {
  in_addr address{};
  return inet_pton(AF_INET, std::string(wanted).c_str(), &address) == 1;
}

FoundCamera listed_camera(unsigned k) {
  FoundCamera found;
  const std::string address = text(arv_get_device_address(k));
  found.path = std::string(kGenicamPath) + (is_address(address) ? address : text(arv_get_device_id(k)));
  found.name = text(arv_get_device_vendor(k)) + " " + text(arv_get_device_model(k));
  found.driver = text(arv_get_device_protocol(k));
  found.bus = address.empty() ? text(arv_get_device_physical_id(k)) : address;
  found.serial = text(arv_get_device_serial_nbr(k));
  return found;
}

/// For a camera that was opened by its address, which no list describes.
FoundCamera described(ArvDevice* device, std::string_view address) {
  FoundCamera found;
  found.path = std::string(kGenicamPath) + std::string(address);
  found.driver = "GigEVision";
  found.bus = address;
  GLibError error;
  const auto word = [&](const char* name) {
    return text(arv_device_get_string_feature_value(device, name, error.out()));
  };
  found.name = word("DeviceVendorName") + " " + word("DeviceModelName");
  found.serial = word("DeviceSerialNumber");
  if (found.serial.empty()) found.serial = word("DeviceID");
  return found;
}

Result<FoundCamera> choose(std::string_view wanted) {
  const auto all = find_genicam_cameras();
  std::string names;
  for (const FoundCamera& one : all)
    names += fmt::format("{}{} ({}, serial {})", names.empty() ? "" : ", ", one.path, one.name, one.serial);
  if (all.empty())
    return Error{ErrorCode::device_lost, "no GenICam camera answers",
                 "check its power and cable; GigE Vision: its address is in the network of this computer; "
                 "USB3 Vision: the udev rule 60-symrig.rules is installed"};
  std::vector<FoundCamera> fitting;
  std::ranges::copy_if(all, std::back_inserter(fitting), [wanted](const FoundCamera& one) {
    return wanted.empty() || wanted == one.path || wanted == one.serial || wanted == one.bus ||
           wanted == one.name;
  });
  if (fitting.size() == 1) return fitting.front();
  if (fitting.empty())
    return Error{ErrorCode::unknown_name, fmt::format("no GenICam camera is '{}'", wanted),
                 "connected: " + names};
  return Error{ErrorCode::bad_argument, "several GenICam cameras fit", "name one of " + names};
}

Error not_opened(const GLibError& error, std::string_view camera) {
  const std::string cause = error.text();
  if (cause.find("LIBUSB_ERROR_BUSY") != std::string::npos)
    return {ErrorCode::device_refused, fmt::format("camera {}: another program controls it", camera),
            "end that program"};
  const bool gone = error.silent();
  return {gone ? ErrorCode::device_lost : ErrorCode::device_refused,
          fmt::format("camera {} cannot be opened: {}", camera, cause),
          gone ? "check its power, its cable and its address"
               : "end the program that controls it, or wait for its heartbeat to end"};
}

}  // namespace

Result<OpenDevice> open_device(std::string_view wanted) {
  std::string_view name = wanted;
  if (name.starts_with(kGenicamPath)) name.remove_prefix(kGenicamPath.size());
  OpenDevice open;
  std::string id(name);
  if (!is_address(name)) {
    SYMRIG_TRY(open.found, choose(wanted));
    id = open.found.path.substr(kGenicamPath.size());
  }
  const std::lock_guard lock(list_mutex());
  const WithoutComplaints quiet;
  GLibError error;
  open.device.reset(arv_open_device(id.c_str(), error.out()));
  if (!open.device) return not_opened(error, id);
  if (ARV_IS_GV_DEVICE(open.device.get()) != 0 &&
      arv_gv_device_is_controller(ARV_GV_DEVICE(open.device.get())) == 0)
    return Error{ErrorCode::device_refused, fmt::format("camera {}: another program controls it", id),
                 "end that program, or wait for its heartbeat to end"};
  if (open.found.path.empty()) open.found = described(open.device.get(), id);
  return open;
}

std::vector<FoundCamera> find_genicam_cameras() {
  const std::lock_guard lock(list_mutex());
  arv_update_device_list();
  std::vector<FoundCamera> all;
  for (unsigned k = 0; k < arv_get_n_devices(); ++k) all.push_back(listed_camera(k));
  std::ranges::sort(all, {}, &FoundCamera::path);
  return all;
}

Result<CameraInfo> look_at_genicam_camera(std::string_view path) {
  SYMRIG_TRY(const OpenDevice open, open_device(path));
  const Features features(open.device.get(), open.found.path);
  CameraInfo info{open.found, {}, {}};
  SizeOffer size;
  if (const auto rows = features.bounds("Height"), cols = features.bounds("Width"); rows && cols) {
    size.least = {static_cast<int>(rows->first), static_cast<int>(cols->first)};
    size.most = {static_cast<int>(rows->second), static_cast<int>(cols->second)};
  }
  for (const std::string& name : features.entries("PixelFormat")) {
    const PixelFormat* const format = find_genicam_format(name);
    info.formats.push_back({format == nullptr ? 0 : format->fourcc, name, format, {size}});
  }
  for (const std::string& name : features.names())
    if (const auto control = features.info(name)) info.controls.push_back(*control);
  return info;
}

}  // namespace symrig::camera
