// SPDX-License-Identifier: Apache-2.0
#include "calibration/sensor/bracket_checks.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/hdr/internal/clipping.hpp"
#include "symrig/hdr/merge.hpp"
#include "symrig/hdr/response.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr const char* kUnitsOfCodes = "light of the largest code per second";

/// The mean of some frames, in whole codes.
SensorPhotographs::Codes mean_of(std::span<const Frame> frames, const std::vector<std::size_t>& which) {
  std::vector<double> sum(frames[which.front()].raw.size());
  for (const std::size_t k : which)
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += frames[k].raw[i];
  SensorPhotographs::Codes mean;
  mean.reserve(sum.size());
  for (const double one : sum)
    mean.push_back(static_cast<std::uint16_t>(std::lround(one / static_cast<double>(which.size()))));
  return mean;
}

/// Ratios of neighbouring exposures. Of a scene, a rig takes many frames at each exposure. Their means are
/// compared: a lamp that flickers makes no exposure wrong.
Result<std::vector<ExposureRatio>> ratios_of(const SensorPhotographs& photographs,
                                             std::span<const Frame> frames, const NoiseModel& noise) {
  if (!photographs.scene) return exposure_ratios(frames, noise);
  std::map<Nanoseconds, std::vector<std::size_t>> levels;
  for (std::size_t k = 0; k < frames.size(); ++k) levels[frames[k].exposure].push_back(k);
  std::vector<SensorPhotographs::Codes> means;
  std::vector<Frame> of_levels;
  std::vector<std::size_t> first;
  means.reserve(levels.size());  // frames refer to them
  for (const auto& [exposure, which] : levels) {
    means.push_back(mean_of(frames, which));
    of_levels.push_back({means.back(), exposure});
    first.push_back(which.front());
  }
  SYMRIG_TRY(std::vector<ExposureRatio> ratios, exposure_ratios(of_levels, noise));
  for (ExposureRatio& ratio : ratios) {
    ratio.shorter = first[ratio.shorter];
    ratio.longer = first[ratio.longer];
  }
  return ratios;
}

/// Of a linear sensor.
Result<void> merge_linear(const SensorPhotographs& photographs, std::span<const Frame> frames,
                          MergedBracket& merged) {
  const Sensor& sensor = *merged.camera.sensor;
  if (sensor.noise.bits() != photographs.bits)
    return Error{ErrorCode::bad_value,
                 fmt::format("the sensor has {} bits, the frames {}", sensor.noise.bits(), photographs.bits),
                 "give the sensor.toml of this camera, or correct [sensor] bits"};
  if (!sensor.defects.empty() && sensor.defects.grid() != photographs.grid)
    return Error{ErrorCode::bad_value,
                 fmt::format("the sensor's defects are of {}, the frames {}",
                             to_string(sensor.defects.grid()), to_string(photographs.grid)),
                 "measure the sensor with frames of this size, or remove its defects"};
  std::vector<Nanoseconds> exposures;
  for (const Frame& frame : frames) exposures.push_back(frame.exposure);
  SYMRIG_TRY(MergeStream stream,
             MergeStream::begin(photographs.grid, photographs.channels, sensor.noise, exposures));
  for (const Frame& frame : frames) SYMRIG_CHECK(stream.add(frame));
  MergeOptions options;
  if (!sensor.defects.empty()) options.dead = &sensor.defects;
  const NoiseModel& noise = sensor.noise;
  if (merged.camera.straight) options.scale = noise.gain() / (noise.max_code() - noise.pedestal());
  SYMRIG_TRY(merged.radiance, stream.finish(options));
  SYMRIG_TRY(merged.ratios, ratios_of(photographs, frames, sensor.noise));
  merged.units = merged.camera.straight ? kUnitsOfCodes : "electrons per second";
  return {};
}

Result<void> merge_curved(const SensorPhotographs& photographs, std::span<const Frame> frames,
                          MergedBracket& merged) {
  const std::size_t codes = merged.camera.response->light.size();
  if (codes != std::size_t{1} << static_cast<unsigned>(photographs.bits))
    return Error{
        ErrorCode::bad_value,
        fmt::format("the response curve has {} codes, the frames have {} bits", codes, photographs.bits),
        "give the response.toml of this camera, or correct [sensor] bits"};
  SYMRIG_TRY(ResponseMerge by_response,
             merge_by_response(frames, photographs.grid, photographs.channels, *merged.camera.response,
                               usable_codes(photographs, merged.camera.sensor)));
  merged.radiance = std::move(by_response.radiance);
  merged.code_variance = std::move(by_response.code_variance);
  merged.ratios = std::move(by_response.ratios);
  merged.units = kUnitsOfCodes;
  return {};
}

/// The frames with exposures that have the ratios which their pixels show.
std::vector<Frame> with_seen_exposures(std::vector<Frame> frames, const std::vector<ExposureRatio>& ratios) {
  for (const ExposureRatio& ratio : ratios) {  // ascending: the shorter one is right already
    const double exposure = static_cast<double>(frames[ratio.shorter].exposure.count()) * ratio.seen;
    const double by = exposure / static_cast<double>(frames[ratio.longer].exposure.count());
    const Nanoseconds from = frames[ratio.longer].exposure;
    for (Frame& frame : frames)
      if (frame.exposure >= from)
        frame.exposure = Nanoseconds{std::llround(static_cast<double>(frame.exposure.count()) * by)};
  }
  return frames;
}

/// The camera may clip before the code that its sensor.toml says, or assumes.
void correct_clipping(std::span<const Frame> frames, MergedBracket& merged) {
  if (!merged.camera.sensor) return;
  const int stated = merged.camera.sensor->noise.clipping_code();
  if (clip_as_seen(frames, *merged.camera.sensor))
    merged.warnings.push_back(fmt::format(
        "the camera clips at code {}, not at {}: pixels stay there although a shorter exposure expects more; "
        "codes from {} on do not count (measure the sensor again, with a flat that saturates)",
        merged.camera.sensor->noise.clipping_code(), stated, merged.camera.sensor->noise.saturation_code()));
}

/// The lowest code that does not count.
int saturation_of(const SensorPhotographs& photographs, const SensorFindings& camera) {
  const int largest = (1 << photographs.bits) - 1;
  if (!camera.response) return camera.sensor->noise.saturation_code();
  const int high = usable_codes(photographs, camera.sensor).high;
  return high < 0 ? largest : high;
}

/// Says which share of the values is saturated even in the shortest exposure. They have no light to tell.
void warn_of_burnt(std::span<const Frame> frames, MergedBracket& merged) {
  constexpr double kTold = 1e-3;
  const Frame& shortest = *std::min_element(
      frames.begin(), frames.end(), [](const Frame& a, const Frame& b) { return a.exposure < b.exposure; });
  const auto burnt =
      static_cast<double>(std::count_if(shortest.raw.begin(), shortest.raw.end(),
                                        [&](std::uint16_t code) { return code >= merged.saturation; }));
  const double share = burnt / static_cast<double>(shortest.raw.size());
  if (share > kTold)
    merged.warnings.push_back(
        fmt::format("{:.2g} % of the values are saturated in all exposures: they are 0 and "
                    "not valid (add a shorter exposure)",
                    100 * share));
}

/// A curve that was recovered from dark photographs says nothing of bright codes, nor of the unit.
void warn_of_guessed_curve(const SensorPhotographs& photographs, std::span<const Frame> frames,
                           MergedBracket& merged) {
  constexpr double kSeen = 0.5;  // of the largest code
  const int largest = (1 << photographs.bits) - 1;
  int most = 0;
  for (const Frame& frame : frames) most = std::max(most, hdr::brightest(frame.raw));
  if (most < kSeen * largest)
    merged.warnings.push_back(fmt::format(
        "no photograph reaches half of the largest code ({} of {}): the curve beyond, and the unit of the "
        "radiance, are guessed (add longer exposures, or give --response)",
        most, largest));
}

/// Whether the exposures are wrong by so much that the light of dark pixels does not fit that of bright ones.
/// Shutters miss what is written on them by 7 %: 1/60 s is 1/64 s, and 1/125 s is 1/128 s.
bool ratios_spoil(const std::vector<ExposureRatio>& ratios) {
  constexpr double kMost = 0.1;
  double off = 0, least = 0, most = 0;  // log of an exposure over what is stated
  for (const ExposureRatio& ratio : ratios) {
    if (ratio.wrong()) off += std::log(ratio.seen / ratio.stated);
    least = std::min(least, off), most = std::max(most, off);
  }
  return most - least > std::log1p(kMost);
}

/// What exposures and pixels contradict: warnings, and what no picture should be made of.
struct Contradictions {
  std::vector<std::string> small, large;
};

/// A curve that two methods find so differently is none: codes are wrong by a factor.
constexpr double kUnknownCurve = 0.25;  // of full light

std::string doubt_text(const SensorFindings& camera) {
  return fmt::format(
      "two methods of recovering the response differ by {:.2g} % of full light: exposures are too dark "
      "or too far apart to tell it, or exposures, scene or lamp changed",
      100 * camera.response_doubt);
}

/// What a curve cannot bring together counts as noise of codes. No camera has as much. Empty: it is less.
std::string unlike_text(const MergedBracket& merged) {
  constexpr double kMost = 0.06;  // of the largest code
  if (merged.code_variance.empty()) return {};
  const double sigma = std::sqrt(median(std::vector<double>(merged.code_variance)));
  if (sigma <= kMost * static_cast<double>(merged.code_variance.size())) return {};
  return fmt::format(
      "the photographs differ by {:.2g} codes rms where they should agree: the scene moved, or exposures, "
      "light or camera changed",
      sigma);
}

Contradictions contradictions_of(const SensorPhotographs& photographs, const MergedBracket& merged,
                                 const std::vector<calibration::BracketChange>& changes) {
  Contradictions found;
  std::vector<std::string>& ratios = ratios_spoil(merged.ratios) ? found.large : found.small;
  for (const ExposureRatio& ratio : merged.ratios)
    if (ratio.wrong())
      ratios.push_back(
          fmt::format("{} has {:.3g} times the light of {} by its pixels, {:.3g} times by its exposure",
                      photographs.bracket[ratio.longer].file, ratio.seen,
                      photographs.bracket[ratio.shorter].file, ratio.stated));
  for (const calibration::BracketChange& change : changes)
    (change.everywhere ? found.large : found.small).push_back(change.what);
  if (std::string unlike = unlike_text(merged); !unlike.empty()) found.large.push_back(std::move(unlike));
  if (merged.camera.doubtful())
    (merged.camera.response_doubt > kUnknownCurve ? found.large : found.small)
        .push_back(doubt_text(merged.camera));
  return found;
}

Error contradicts(const std::vector<std::string>& large) {
  return {
      ErrorCode::bad_value,
      large.front() + (large.size() > 1 ? fmt::format(" (and {} more)", large.size() - 1) : ""),
      "photograph the bracket again, of a still scene in steady light, or correct its exposures; --unchecked "
      "merges it all the same"};
}

/// Pixels that have another light in two exposures, and those near them: what has moved has a surface, and
/// not each of its pixels is seen well twice. Nobody knows which exposure is right.
void discard(const std::vector<calibration::BracketChange>& changes, Radiance& radiance) {
  constexpr int kNear = 2;
  const Grid grid = radiance.valid.grid();
  for (const calibration::BracketChange& change : changes)
    for (const std::size_t at : change.values) {
      const auto pixel = static_cast<int>(at % static_cast<std::size_t>(grid.size()));
      const int row = pixel / grid.cols, col = pixel % grid.cols;
      for (int channel = 0; channel < radiance.valid.channels(); ++channel)
        for (int r = std::max(0, row - kNear); r <= std::min(grid.rows - 1, row + kNear); ++r)
          for (int c = std::max(0, col - kNear); c <= std::min(grid.cols - 1, col + kNear); ++c) {
            const auto to = static_cast<std::size_t>(r) * static_cast<std::size_t>(grid.cols) +
                            static_cast<std::size_t>(c);
            radiance.mean.plane(channel)[to] = radiance.variance.plane(channel)[to] = 0;
            radiance.valid.plane(channel)[to] = 0;
          }
    }
}

Result<void> check_any_valid(std::span<const Frame> frames, int saturation, const Radiance& radiance) {
  if (std::ranges::any_of(radiance.valid.values(), [](std::uint8_t v) { return v != 0; })) return {};
  const auto& codes = frames.front().raw;
  const bool burnt =
      2 * std::ranges::count_if(codes, [&](std::uint16_t code) { return code >= saturation; }) >
      std::ssize(codes);
  return Error{
      ErrorCode::bad_value,
      burnt ? "all photographs of the bracket are saturated" : "no photograph of the bracket holds light",
      burnt ? "add shorter exposures" : "let light reach the camera, or add longer exposures"};
}

/// A wrong exposure looks like a curve. It is none if the camera is linear with exposures that fit the
/// pixels.
Result<void> blame_exposures(std::span<const Frame> frames, SensorFindings& camera) {
  if (!camera.sensor || !camera.response) return {};
  SYMRIG_TRY(const std::vector<ExposureRatio> ratios, exposure_ratios(frames, camera.sensor->noise));
  const std::vector<Frame> seen = with_seen_exposures({frames.begin(), frames.end()}, ratios);
  SYMRIG_TRY(const Linearity linearity, test_linearity(seen, camera.sensor->noise));
  if (!linearity.linear()) return {};
  camera.linearity = linearity;
  camera.response.reset();
  camera.response_doubt = 0;
  return {};
}

}  // namespace

Result<BracketFolder> read_bracket_folder(const std::filesystem::path& folder, KnownCamera camera,
                                          const Progress& progress) {
  BracketFolder read{{}, std::move(camera)};
  SYMRIG_TRY(read.photographs, read_sensor_folder(folder, progress));
  if (!read.photographs.scene || read.camera.sensor || read.camera.response) return read;
  SYMRIG_TRY(MeasuredSensor measured, measure_sensor_folder(folder, progress));
  read.camera.sensor = std::move(measured.findings.sensor);
  read.camera.response = std::move(measured.findings.response);
  read.camera.response_doubt = measured.findings.response_doubt;
  return read;
}

Result<MergedBracket> merge_bracket(const SensorPhotographs& photographs, const KnownCamera& known,
                                    const BracketOptions& options) {
  const std::vector<Frame> frames = bracket_of(photographs);
  if (frames.size() < 2)
    return Error{ErrorCode::bad_value, "the folder has fewer than two exposures of a still scene",
                 "name them in [[sensor.bracket]] of its capture.toml"};
  SYMRIG_CHECK(calibration::check_bracket_order(photographs));
  MergedBracket merged;
  if (known.sensor || known.response) {
    merged.camera.sensor = known.sensor;
    merged.camera.response = known.response;
    merged.camera.response_doubt = known.response_doubt;
    correct_clipping(frames, merged);
  } else {
    SYMRIG_TRY(merged.camera, examine_sensor(photographs));
    SYMRIG_CHECK(blame_exposures(frames, merged.camera));
    if (merged.camera.straight) {
      merged.camera.sensor.emplace().noise = *merged.camera.straight;
      merged.camera.response.reset();
    }
  }
  SYMRIG_CHECK(merged.camera.response ? merge_curved(photographs, frames, merged)
                                      : merge_linear(photographs, frames, merged));
  merged.saturation = saturation_of(photographs, merged.camera);
  const auto changes = calibration::find_bracket_changes(photographs, frames, merged);
  Contradictions found = contradictions_of(photographs, merged, changes);
  if (!options.unchecked) {
    if (!found.large.empty()) return contradicts(found.large);
    SYMRIG_CHECK(check_any_valid(frames, merged.saturation, merged.radiance));
    discard(changes, merged.radiance);
  }
  warn_of_burnt(frames, merged);
  if (merged.camera.response && !known.response) warn_of_guessed_curve(photographs, frames, merged);
  merged.warnings.insert(merged.warnings.end(), found.large.begin(), found.large.end());
  merged.warnings.insert(merged.warnings.end(), found.small.begin(), found.small.end());
  return merged;
}

}  // namespace symrig
