// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/sensor.hpp"

#include "hdr/sensor_statistics.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/hdr/internal/clipping.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

namespace symrig {
namespace {

using hdr::Codes;

constexpr double kUnresponsive = 0.3;  // largest difference from the neighbours' response, as a share of it
constexpr double kPiledUp = 2;         // times the dark noise: a bright level with less spread is clipped

Error bad_frames(ErrorCode code, std::string what, std::string hint) {
  return {code, std::move(what), std::move(hint)};
}

Result<void> check(const SensorFrames& frames) {
  if (!frames.grid.valid() || frames.bits < 1 || frames.bits > 16)
    return bad_frames(
        ErrorCode::bad_argument,
        fmt::format("a sensor of {} and {} bits cannot be measured", to_string(frames.grid), frames.bits),
        "give its grid and 1 to 16 bits");
  if (frames.dark.size() < 2)
    return bad_frames(ErrorCode::bad_argument, fmt::format("{} dark frames are too few", frames.dark.size()),
                      "take at least two, with the lens capped");
  std::vector<Codes> all = frames.dark;
  for (std::size_t level = 0; level < frames.flat.size(); ++level) {
    if (frames.flat[level].size() < 2)
      return bad_frames(ErrorCode::bad_argument,
                        fmt::format("level {} has fewer than two flat frames", level),
                        "take at least two: their difference gives the noise");
    all.insert(all.end(), frames.flat[level].begin(), frames.flat[level].end());
  }
  for (const Codes& codes : all)
    if (std::ssize(codes) != frames.grid.size())
      return bad_frames(
          ErrorCode::size_mismatch,
          fmt::format("a frame has {} samples, the sensor {}", codes.size(), frames.grid.size()),
          "give frames of one camera, one plane each");
  return {};
}

std::vector<double> light_of(const std::vector<Codes>& level, const std::vector<double>& dark) {
  std::vector<double> light = hdr::moments(level).mean;
  for (std::size_t i = 0; i < light.size(); ++i) light[i] -= dark[i];
  return light;
}

/// Marks pixels whose response to light is much smaller or larger than their neighbours'.
void find_unresponsive(const std::vector<double>& light, const std::vector<double>& local,
                       std::span<std::uint8_t> defects) {
  for (std::size_t i = 0; i < defects.size(); ++i)
    if (std::abs(light[i] - local[i]) > kUnresponsive * std::max(local[i], 1.0)) defects[i] = 1;
}

/// Where a tenth of the pixels seem to be defects, it is the light or the sensor that is of another kind.
Result<void> check_defects(std::span<const std::uint8_t> defects) {
  constexpr double kMost = 0.1;
  const double share = static_cast<double>(std::count_if(defects.begin(), defects.end(),
                                                         [](std::uint8_t d) { return d != 0; })) /
                       static_cast<double>(defects.size());
  if (share <= kMost) return {};
  return bad_frames(
      ErrorCode::bad_value,
      fmt::format(
          "{:.0f} % of the pixels respond unlike their neighbours: the flat frames are not smooth, or the "
          "sensor has colour filters in a pattern other than 2 x 2",
          100 * share),
      "light the sensor evenly, without structure; give the codes of one colour of another pattern");
}

/// How the differences of two frames of one level depend on their neighbours'.
struct NoiseTexture {
  double along = 0, across = 0;  ///< correlation of neighbours in a row, and in a column
  double along_in_row = 0;       ///< of neighbours in a row, about the row's mean
};

NoiseTexture noise_texture(const std::vector<Codes>& level, double pedestal,
                           std::span<const std::uint8_t> defects, Grid grid) {
  const auto at = [&](int row, int col) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.cols) +
           static_cast<std::size_t>(col);
  };
  std::vector<double> difference(defects.size()), in_row(defects.size());
  // Flicker is a factor on light.
  const double flicker =
      (hdr::mean_of(hdr::moments(std::span(level).subspan(1, 1)).mean, defects) - pedestal) /
      (hdr::mean_of(hdr::moments(std::span(level).first(1)).mean, defects) - pedestal);
  for (std::size_t i = 0; i < difference.size(); ++i)
    difference[i] = level[1][i] - pedestal - flicker * (level[0][i] - pedestal);
  for (int row = 0; row < grid.rows; ++row) {
    double of_row = 0;
    for (int col = 0; col < grid.cols; ++col) of_row += difference[at(row, col)] / grid.cols;
    for (int col = 0; col < grid.cols; ++col) in_row[at(row, col)] = difference[at(row, col)] - of_row;
  }
  const auto correlation = [&](const std::vector<double>& of, int down, int right) {
    double products = 0, squares = 0;
    for (int row = 0; row + down < grid.rows; ++row)
      for (int col = 0; col + right < grid.cols; ++col) {
        const std::size_t here = at(row, col), there = at(row + down, col + right);
        if (defects[here] != 0 || defects[there] != 0) continue;
        products += of[here] * of[there];
        squares += (of[here] * of[here] + of[there] * of[there]) / 2;
      }
    return squares > 0 ? products / squares : 0;
  };
  return {correlation(difference, 0, 1), correlation(difference, 1, 0), correlation(in_row, 0, 1)};
}

/// Each raw pixel has its own noise. Crosstalk of pixels correlates it by some hundredths; sharpening,
/// denoising and JPEG do by more, and then variances tell nothing about electrons.
Result<void> check_raw(const std::vector<Codes>& level, double pedestal,
                       std::span<const std::uint8_t> defects, Grid grid) {
  constexpr double kMost = 0.1;
  constexpr std::int64_t kFewest = 2500;  // pixels: chance alone reaches a fifth of kMost
  if (grid.size() < kFewest) return {};
  const NoiseTexture found = noise_texture(level, pedestal, defects, grid);
  if (std::max(std::abs(found.along_in_row), std::abs(found.across)) > kMost &&
      std::abs(found.along_in_row) > kMost / 2)
    return bad_frames(
        ErrorCode::bad_value,
        fmt::format(
            "the noise of neighbouring pixels is correlated, by {:+.2f} in rows and {:+.2f} in columns: the "
            "flat frames are processed (sharpened, denoised or JPEG)",
            found.along_in_row, found.across),
        "take raw frames, without sharpening, noise reduction and compression");
  if (found.along > kMost)
    return bad_frames(
        ErrorCode::bad_value,
        fmt::format("the flat frames of a level differ in bands: {:.0f} % of the squared difference is "
                    "common to a row; the light flickers (rolling shutter)",
                    100 * found.along),
        "expose for whole periods of the lamp, or use a steady one");
  return {};
}

/// Two frames have their own noise each. Frames of one value are saturated, and may be equal.
Result<void> check_copies(const std::vector<std::vector<Codes>>& flat) {
  for (const auto& level : flat)
    for (std::size_t k = 0; k + 1 < level.size(); ++k)
      if (std::ranges::equal(level[k], level[k + 1]) &&
          robust_sigma(std::vector<double>(level[k].begin(), level[k].end())) > 0)
        return bad_frames(ErrorCode::bad_value,
                          "two flat frames of a level are equal in every pixel: one frame was taken twice, "
                          "or the camera shows no noise",
                          "take each frame anew");
  return {};
}

/// Photons make variances that are a straight line of the light. A tone curve bends it.
Result<void> check_straight(std::vector<hdr::TransferPoint> points, const hdr::TransferLine& line) {
  constexpr std::size_t kGroups = 6;
  constexpr double kMost = 0.15, kDeviations = 5;
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.mean < b.mean; });
  for (std::size_t group = 0; group < kGroups; ++group) {
    double ratio = 0, samples = 0, light = 0;
    for (std::size_t k = group * points.size() / kGroups; k < (group + 1) * points.size() / kGroups; ++k) {
      ratio += points[k].samples * points[k].variance / (line.offset + line.slope * points[k].mean);
      light += points[k].samples * points[k].mean, samples += points[k].samples;
    }
    if (!(samples > 0) || std::abs(ratio / samples - 1) <= kMost + kDeviations * std::sqrt(2 / samples))
      continue;
    return bad_frames(
        ErrorCode::bad_value,
        fmt::format("the noise of the frames is not a straight line of their light: at {:.0f} DN above "
                    "dark, the variance is {:.2f} times that of the line; they are processed (gamma or "
                    "tone curve)",
                    light / samples, ratio / samples),
        "take raw frames, without gamma and tone curve");
  }
  return {};
}

/// The variation of sensitivity between pixels: Var[light / local] minus the part from temporal noise.
double prnu_of(const std::vector<double>& light, const std::vector<double>& local,
               std::span<const std::uint8_t> defects, const hdr::TransferLine& line, std::size_t frames,
               std::size_t dark_frames) {
  double squares = 0, noise = 0, count = 0;
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (defects[i] != 0 || local[i] <= 0) continue;
    const double ratio = light[i] / local[i] - 1;
    squares += ratio * ratio;
    noise += ((line.offset + line.slope * local[i]) / static_cast<double>(frames) +
              line.offset / static_cast<double>(dark_frames)) /
             (local[i] * local[i]);
    count += 1;
  }
  return count > 0 ? hdr::rms_beyond(squares, count, noise / count) : 0;
}

/// Adds the pairs of frames of a level: first with second, third with fourth …
void add_pairs(const std::vector<Codes>& level, std::span<const std::uint8_t> defects, Grid grid,
               double pedestal, double saturation, std::vector<hdr::TransferPoint>& points) {
  for (std::size_t k = 0; k + 1 < level.size(); k += 2)
    hdr::add_transfer_points(level[k], level[k + 1], defects, grid, pedestal, saturation, points);
}

/// The lowest code at which a bright level clips, or a part of it. Codes of a whole level that clips have no
/// more spread than dark ones, although light makes noise. nullopt: none clips.
std::optional<int> clipping_seen(const SensorFrames& frames, double dark_noise) {
  const double dim = 0.25 * ((1 << frames.bits) - 1);
  std::optional<int> clipped;
  for (const auto& level : frames.flat) {
    std::vector<double> codes(level.front().begin(), level.front().end());
    const double spread = robust_sigma(codes);
    auto code = hdr::clipping_of_flat(level.front(), dark_noise);
    if (spread <= kPiledUp * std::max(dark_noise, 0.5)) code = static_cast<int>(median(codes));
    if (code && *code > dim) clipped = std::min(clipped.value_or(*code), *code);
  }
  return clipped;
}

}  // namespace

std::string Sensor::to_string() const {
  std::int64_t count = 0;
  for (const std::uint8_t d : defects.values()) count += d != 0 ? 1 : 0;
  return fmt::format(
      "{}; gain known to {:.2g} %, read noise to {:.2g} %; PRNU {:.2g} %, DSNU {:.2g} DN, {} defects",
      noise.to_string(), 100 * gain_sigma, 100 * read_noise_sigma, 100 * prnu, dsnu, count);
}

Result<Sensor> measure_sensor(const SensorFrames& frames) {
  SYMRIG_CHECK(check(frames));
  SYMRIG_CHECK(check_copies(frames.flat));
  hdr::DarkCodes dark_codes;
  for (const Codes& codes : frames.dark) dark_codes.add(codes);
  SYMRIG_CHECK(dark_codes.check());
  Sensor sensor;
  sensor.defects = Image<std::uint8_t>(frames.grid);
  const auto defects = sensor.defects.values();
  const hdr::PixelMoments dark = hdr::moments(frames.dark);
  hdr::find_hot(dark, frames.dark.size(), defects);
  const double pedestal = hdr::mean_of(dark.mean, defects);
  std::vector<double> noises = dark.variance;
  const auto seen = clipping_seen(frames, std::sqrt(median(noises)));
  const int clipping = seen.value_or((1 << frames.bits) - 1);
  sensor.clipping_seen = seen.has_value();
  const std::vector<Codes>* brightest = nullptr;
  double most = 0;
  for (const auto& level : frames.flat) {
    const std::vector<double> codes = hdr::moments(level).mean;
    const double mean = hdr::mean_of(codes, defects);
    // Colours differ: the brightest one must not clip either.
    const double bright = quantile(std::vector(codes), 0.98), range = clipping - pedestal;
    if (mean <= most || mean >= pedestal + 0.75 * range || bright >= pedestal + 0.9 * range) continue;
    most = mean;
    brightest = &level;
  }
  if (brightest == nullptr || most - pedestal < 0.02 * (clipping - pedestal))
    return bad_frames(
        ErrorCode::bad_value,
        fmt::format("no flat level is between the dark level {:.0f} DN and saturation", pedestal),
        "take flat frames at a tenth to two thirds of the range");
  const std::vector<double> light = light_of(*brightest, dark.mean);
  std::vector<double> local = hdr::smooth_by_colour(light, defects, frames.grid);
  find_unresponsive(light, local, defects);
  SYMRIG_CHECK(check_defects(defects));
  SYMRIG_CHECK(check_raw(*brightest, pedestal, defects, frames.grid));
  local = hdr::smooth_by_colour(light, defects, frames.grid);
  std::vector<hdr::TransferPoint> points;
  add_pairs(frames.dark, defects, frames.grid, pedestal, clipping, points);
  const std::size_t dark_points = points.size();
  for (const auto& level : frames.flat) add_pairs(level, defects, frames.grid, pedestal, clipping, points);
  if (dark_points == 0 || points.size() == dark_points)
    return bad_frames(ErrorCode::bad_value, "no tile of the frames is free of defects and saturation",
                      "take frames of at least 8 x 8 good pixels");
  const hdr::TransferLine line = hdr::fit_transfer(points);
  if (!line.rises())
    return bad_frames(ErrorCode::bad_value,
                      "the noise of the flat frames does not grow with their light: they are processed "
                      "(gamma or tone curve)",
                      "take raw frames, not processed ones, and light the sensor evenly");
  SYMRIG_CHECK(check_straight(points, line));
  hdr::set_noise(sensor, line, frames.bits, pedestal, clipping);
  sensor.prnu = prnu_of(light, local, defects, line, brightest->size(), frames.dark.size());
  sensor.dsnu = hdr::dsnu_of(dark, defects, frames.dark.size());
  return sensor;
}

FramesNeeded frames_needed(std::int64_t pixels, double gain_error, double read_noise_error) {
  // gain: the slope between the dark end and level m has an error of √(2 / n) of the variance there,
  // times 1.5 with the share of the dark end. read noise: the root of an offset, of which at most a tenth is
  // rounding. So its error is half of √(2 / n), plus that of the gain.
  const double n = static_cast<double>(std::max<std::int64_t>(1, pixels));
  FramesNeeded needed;
  needed.flat_pairs = std::max(1, static_cast<int>(std::ceil(1.5 * 1.5 * 2 / (gain_error * gain_error) / n)));
  const double rest = std::max(read_noise_error * read_noise_error - gain_error * gain_error,
                               read_noise_error * read_noise_error / 4);
  needed.dark = 2 * std::max(1, static_cast<int>(std::ceil(1.2 * 1.2 / (2 * rest) / n)));
  return needed;
}

}  // namespace symrig
