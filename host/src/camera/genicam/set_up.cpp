// SPDX-License-Identifier: Apache-2.0

#include "camera/genicam/set_up.hpp"

#include "camera/genicam/features.hpp"
#include "symrig/base/text.hpp"
#include "symrig/camera/internal/frame_reader.hpp"
#include "symrig/camera/internal/genicam_camera.hpp"

#include <algorithm>
#include <cmath>
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

namespace {

Result<const PixelFormat*> chosen_format(const Features& features, const GenicamSettings& settings) {
  const auto offered = features.entries("PixelFormat");
  const auto has = [&offered](std::string_view name) {
    return std::ranges::find(offered, name) != offered.end();
  };
  if (settings.format.empty()) {
    for (const PixelFormat& format : genicam_formats())
      if (has(format.name)) return &format;
    return Error{ErrorCode::device_refused, "the camera has no pixel format that symrig can read",
                 fmt::format("it has {}", fmt::join(offered, ", "))};
  }
  if (!has(settings.format))
    return Error{ErrorCode::unknown_name, fmt::format("the camera has no pixel format '{}'", settings.format),
                 nearest_hint(settings.format, offered)};
  if (const PixelFormat* const format = find_genicam_format(settings.format)) return format;
  return Error{ErrorCode::unknown_name,
               fmt::format("symrig cannot read the pixel format {}", settings.format),
               "take a Mono or Bayer format of 8 to 16 bits"};
}

Result<SampleDepth> sample_depth(const PixelFormat& format, const GenicamSettings& settings) {
  if (settings.bits == 0 || settings.bits == format.bits) return SampleDepth{format.bits, 0};
  if (format.bits != 16 || settings.bits < 1 || settings.bits > 16)
    return Error{ErrorCode::bad_argument,
                 fmt::format("{} bits were stated, but {} has {}", settings.bits, format.name, format.bits),
                 "state the bits of the format"};
  return SampleDepth{settings.bits, settings.justified == Justified::high ? 16 - settings.bits : 0};
}

Result<int> set_side(Features& features, std::string_view side, std::string_view offset, int at, int length) {
  const bool moves = features.has(offset);
  if (moves) SYMRIG_CHECK(features.set(offset, "0"));
  SYMRIG_TRY(const auto limits, features.bounds(side));
  const std::int64_t wanted = length == 0 ? limits.second - at : length;
  SYMRIG_CHECK(features.set(side, std::to_string(wanted)));
  if (moves && at != 0) SYMRIG_CHECK(features.set(offset, std::to_string(at)));
  if (!moves && at != 0)
    return Error{ErrorCode::unknown_name, fmt::format("the camera has no feature '{}'", offset),
                 "begin the region at row 0, column 0"};
  return static_cast<int>(wanted);
}

/// Binning changes the greatest width and height, so it comes first.
Result<void> set_binning(Features& features, int binning) {
  if (binning == 0) return {};
  SYMRIG_CHECK(features.set("BinningHorizontal", std::to_string(binning)));
  return features.set("BinningVertical", std::to_string(binning));
}

Result<PictureLayout> set_picture(Features& features, const GenicamSettings& settings) {
  PictureLayout layout;
  SYMRIG_CHECK(set_binning(features, settings.camera_binning));
  SYMRIG_TRY(layout.format, chosen_format(features, settings));
  SYMRIG_CHECK(features.set("PixelFormat", layout.format->name));
  SYMRIG_TRY(layout.depth, sample_depth(*layout.format, settings));
  const Region& region = settings.region;
  SYMRIG_TRY(layout.size.cols, set_side(features, "Width", "OffsetX", region.col, region.size.cols));
  SYMRIG_TRY(layout.size.rows, set_side(features, "Height", "OffsetY", region.row, region.size.rows));
  const int group = group_samples(layout.format->packing);
  if (layout.size.cols % group != 0)
    return Error{ErrorCode::bad_argument,
                 fmt::format("{} columns of {} end within a byte", layout.size.cols, layout.format->name),
                 fmt::format("take a multiple of {} columns", group)};
  layout.stride = row_bytes(*layout.format, layout.size.cols);
  return layout;
}

std::string readout_node(const Features& features) {
  return features.first_of({"SensorReadoutTime", "ReadoutTime", "ReadoutTimeAbs"});
}

Result<void> switch_off(Features& features, std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names)
    if (features.has(name)) SYMRIG_CHECK(features.set(name, "Off"));
  return {};
}

Result<void> set_exposure(Features& features, const GenicamSettings& settings) {
  if (!settings.exposure) {
    if (settings.line.empty()) return {};
    return features.set("ExposureMode", "TriggerWidth");
  }
  if (features.has("ExposureMode")) SYMRIG_CHECK(features.set("ExposureMode", "Timed"));
  const std::string name = features.first_of({"ExposureTime", "ExposureTimeAbs"});
  if (name.empty())
    return Error{ErrorCode::unknown_name, "the camera has neither ExposureTime nor ExposureTimeAbs",
                 "set its exposure in [camera.features]"};
  return features.set(name, fmt::format("{}", 1e6 * seconds(*settings.exposure)));
}

/// "ReadOut": the camera takes a trigger as soon as the last exposure has ended. "PreviousFrame" takes one
/// during the exposure too [SFNC 2.7, TriggerOverlap].
Result<void> set_overlap(Features& features, bool wanted) {
  if (!wanted) return features.has("TriggerOverlap") ? features.set("TriggerOverlap", "Off") : Result<void>{};
  if (readout_node(features).empty())
    return Error{ErrorCode::unknown_name, "the camera does not say how long its readout takes",
                 "remove camera.overlap, and give rig.camera.overlap_time_max"};
  const std::vector<std::string> entries = features.entries("TriggerOverlap");
  for (const std::string_view entry : {"ReadOut", "PreviousFrame"})
    if (std::ranges::find(entries, entry) != entries.end()) return features.set("TriggerOverlap", entry);
  return Error{ErrorCode::unknown_name, "the camera cannot expose during its readout",
               "remove camera.overlap"};
}

Result<void> set_trigger(Features& features, const GenicamSettings& settings) {
  if (features.has("TriggerSelector")) SYMRIG_CHECK(features.set("TriggerSelector", "FrameStart"));
  if (settings.line.empty()) {
    if (features.has("TriggerMode")) SYMRIG_CHECK(features.set("TriggerMode", "Off"));
    return set_exposure(features, settings);
  }
  SYMRIG_CHECK(features.set("TriggerMode", "On"));
  SYMRIG_CHECK(features.set("TriggerSource", settings.line));
  if (features.has("TriggerActivation")) SYMRIG_CHECK(features.set("TriggerActivation", settings.activation));
  // Another program may have left a delay or an overlap.
  const std::string delay = features.first_of({"TriggerDelay", "TriggerDelayAbs"});
  if (!delay.empty()) SYMRIG_CHECK(features.set(delay, "0"));
  SYMRIG_CHECK(set_overlap(features, settings.overlap));
  return set_exposure(features, settings);
}

Result<void> set_level(Features& features, std::initializer_list<std::string_view> names,
                       const std::optional<double>& value) {
  if (!value) return {};
  const std::string name = features.first_of(names);
  if (name.empty())
    return Error{ErrorCode::unknown_name, fmt::format("the camera has no feature {}", *names.begin()),
                 "remove it from the settings"};
  return features.set(name, fmt::format("{}", *value));
}

Nanoseconds microseconds(double us) {
  return Nanoseconds(std::llround(1e3 * us));
}

/// A trigger may come this long before the end of a readout. Some cameras have a limit of their own
/// [docs.baslerweb.com, exposure-overlap-time-max].
Nanoseconds overlap_of(const Features& features, Nanoseconds readout) {
  const std::string most = features.first_of({"ExposureOverlapTimeMax", "ExposureOverlapTimeMaxAbs"});
  if (most.empty()) return readout;
  const auto limit = features.real(most);
  return limit ? std::min(readout, microseconds(*limit)) : Nanoseconds{0};
}

std::string enable_chunk(Features& features, std::initializer_list<std::string_view> selectors,
                         std::string_view value) {
  const auto entries = features.entries("ChunkSelector");
  for (const std::string_view selector : selectors) {
    if (std::ranges::find(entries, selector) == entries.end()) continue;
    if (features.set("ChunkSelector", selector) && features.set("ChunkEnable", "true"))
      return std::string(value);
  }
  return {};
}

}  // namespace

Result<PictureLayout> set_up(Features& features, const GenicamSettings& settings) {
  SYMRIG_CHECK(switch_off(features, {"ExposureAuto", "GainAuto", "BlackLevelAuto"}));
  SYMRIG_TRY(PictureLayout layout, set_picture(features, settings));
  if (features.has("AcquisitionMode")) SYMRIG_CHECK(features.set("AcquisitionMode", "Continuous"));
  SYMRIG_CHECK(set_trigger(features, settings));
  SYMRIG_CHECK(set_level(features, {"Gain", "GainRaw", "GainAbs"}, settings.gain));
  SYMRIG_CHECK(set_level(features, {"BlackLevel", "BlackLevelRaw", "BlackLevelAbs"}, settings.black_level));
  for (const ControlSetting& one : settings.features) SYMRIG_CHECK(features.set(one.name, one.value));
  return layout;
}

Result<ChunkNames> set_chunks(Features& features, bool wanted) {
  if (!features.has("ChunkModeActive")) return ChunkNames{};
  SYMRIG_CHECK(features.set("ChunkModeActive", wanted ? "true" : "false"));
  if (!wanted) return ChunkNames{};
  ChunkNames names;
  names.counter = enable_chunk(features, {"TriggerCounter"}, "ChunkTriggerCounter");
  if (names.counter.empty())
    names.counter = enable_chunk(features, {"Triggerinputcounter"}, "ChunkTriggerinputcounter");
  names.exposure = enable_chunk(features, {"ExposureTime"}, "ChunkExposureTime");
  return names;
}

CameraTiming camera_timing(const Features& features, bool overlap, CameraTiming timing) {
  const std::string exposure = features.first_of({"ExposureTime", "ExposureTimeAbs"});
  if (!exposure.empty()) {
    if (const auto limits = features.real_bounds(exposure)) {
      timing.min_exposure = std::max(timing.min_exposure, microseconds(limits->first));
      timing.max_exposure = std::min(
          timing.max_exposure, microseconds(std::min(limits->second, 1e6 * seconds(timing.max_exposure))));
    }
  }
  const std::string readout = readout_node(features);
  if (!readout.empty())
    if (const auto time = features.real(readout))
      timing.readout = std::max(timing.readout, microseconds(*time));
  const std::string delay = features.first_of({"TriggerDelay", "TriggerDelayAbs"});
  if (!delay.empty())
    if (const auto time = features.real(delay)) timing.trigger_delay += microseconds(*time);
  if (overlap) timing.overlap = overlap_of(features, timing.readout);
  return timing;
}

}  // namespace symrig::camera
