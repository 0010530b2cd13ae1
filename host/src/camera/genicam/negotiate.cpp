// SPDX-License-Identifier: Apache-2.0
#include "camera/genicam/negotiate.hpp"

#include "camera/pfnc.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::camera {
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
