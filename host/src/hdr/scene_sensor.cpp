// SPDX-License-Identifier: Apache-2.0
#include "hdr/scene_pixels.hpp"
#include "hdr/sensor_statistics.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/hdr/internal/clipping.hpp"
#include "symrig/hdr/sensor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

using hdr::Codes;

constexpr double kSameExposure = 0.01;  // relative
constexpr double kBeyond = 1.3;         // light that must saturate, in units of the range
constexpr double kSpreadOfClipped = 2;  // times the dark noise: light has more
constexpr std::size_t kFewestClipped = 64;
constexpr double kUsableSigmas = 5;   // of dark noise: above the pedestal, and below clipping
constexpr double kLeastLight = 0.02;  // share of the range that some pixels must reach
constexpr double kFarFromFull = 0.8;  // share of the range up to which light is compared

Error wrong(ErrorCode code, std::string what, std::string hint) {
  return {code, std::move(what), std::move(hint)};
}

bool same(Nanoseconds a, Nanoseconds b) {
  return std::abs(seconds(a) / seconds(b) - 1) <= kSameExposure;
}

}  // namespace

struct SceneTransfer::Inside {
  /// The mean code of a dark level.
  struct DarkMean {
    Nanoseconds exposure{0};
    double sum = 0, frames = 0;
  };

  /// The light of a level, relative to the pair that sorted the pixels.
  struct LevelLight {
    Nanoseconds exposure{0};
    double sum = 0, pairs = 0;
  };

  /// Weighted straight line through the means of dark levels: mean code = pedestal + rate · exposure.
  struct DarkLine {
    double pedestal = 0, rate = 0, rate_sigma = 0;
  };

  Inside(Grid of, int with_bits) : grid(of), bits(with_bits), dark(of) {}

  int largest() const { return (1 << bits) - 1; }
  bool usable(const hdr::GroupPoint& point, int clip) const {
    return point.largest < clip - kUsableSigmas * noise;
  }
  double range() const { return largest() - dark.pedestal(); }
  DarkLine fit_dark() const;
  Result<void> check(Codes codes) const;
  void add_dark(Codes a, Codes b);
  void sort(Codes a, Codes b);
  void add_lit(Codes a, Codes b);
  void find_clipping(Codes codes, double factor);
  void compare_light(Codes a, Codes b);
  Result<double> drift() const;
  Result<void> check_light(int clip) const;
  hdr::TransferLine fit(double pedestal, int clipping) const;
  NoiseModel provisional(const hdr::TransferLine& line, double pedestal, int clipping) const;
  Result<void> recover(const NoiseModel& model, SceneSensor& found) const;
  std::vector<Frame> frames() const;
  Sensor sensor_of(const hdr::TransferLine& line, double pedestal, int clipping) const;

  Grid grid;
  int bits;
  std::optional<SceneLevel> level;
  bool first_pair = true;     // of the level
  hdr::DarkLevel dark;        // the first dark level
  hdr::DarkCodes dark_codes;  // of the first dark level
  std::vector<DarkMean> dark_means;
  std::optional<hdr::LightGroups> groups;
  Nanoseconds sorted_at{0};
  std::vector<hdr::GroupPoint> points;  // means are codes
  std::vector<LevelLight> lights;
  double flicker_squares = 0, flicker_pairs = 0;
  std::optional<int> clipping;
  struct Still {
    std::vector<std::uint16_t> codes;
    Nanoseconds exposure;
  };
  std::vector<Still> bracket;
  double noise = 1;   // of a dark pixel [DN]
  SceneFacts counts;  // its numbers of frames and levels
};

SceneTransfer::SceneTransfer(Grid grid, int bits) : inside_(std::make_unique<Inside>(grid, bits)) {}
SceneTransfer::~SceneTransfer() = default;
SceneTransfer::SceneTransfer(SceneTransfer&&) noexcept = default;
SceneTransfer& SceneTransfer::operator=(SceneTransfer&&) noexcept = default;

Result<void> SceneTransfer::begin(const SceneLevel& level) {
  Inside& in = *inside_;
  if (level.exposure.count() <= 0)
    return wrong(ErrorCode::bad_argument, "a level of a sensor's measurement has no exposure",
                 "give each level its exposure");
  const bool lit_before = in.level && in.level->lit;
  if (!level.lit && lit_before)
    return wrong(ErrorCode::bad_argument, "a dark level comes after a lit one", "give all dark levels first");
  if (level.lit && in.counts.dark_frames < 4)
    return wrong(ErrorCode::bad_argument, fmt::format("{} dark frames are too few", in.counts.dark_frames),
                 "give four or more before the lit frames, at the shortest exposure first");
  if (!level.lit && !in.dark_means.empty() && level.exposure <= in.dark_means.front().exposure)
    return wrong(ErrorCode::bad_argument, "the first dark level does not have the shortest exposure",
                 "sort dark levels by their exposure");
  if (level.lit) {
    in.counts.lit_levels += 1;
    in.lights.push_back({level.exposure});
  } else {
    in.counts.dark_levels += 1;
    in.dark_means.push_back({level.exposure});
  }
  in.level = level;
  in.first_pair = true;
  return {};
}

SceneTransfer::Inside::DarkLine SceneTransfer::Inside::fit_dark() const {
  double w = 0, wt = 0, wtt = 0, wy = 0, wty = 0;
  for (const DarkMean& one : dark_means) {
    const double t = seconds(one.exposure), y = one.sum / one.frames;
    w += one.frames;
    wt += one.frames * t;
    wtt += one.frames * t * t;
    wy += one.frames * y;
    wty += one.frames * t * y;
  }
  const double determinant = w * wtt - wt * wt;
  if (dark_means.size() < 2 || !(determinant > 0)) return {wy / w, 0, 0};
  const double rate = (w * wty - wt * wy) / determinant;
  return {(wy - rate * wt) / w, rate, std::sqrt(dark.variance_of_mean() * w / determinant)};
}

Result<void> SceneTransfer::Inside::check(Codes codes) const {
  if (std::ssize(codes) != grid.size())
    return wrong(ErrorCode::size_mismatch,
                 fmt::format("a frame has {} samples, the sensor {}", codes.size(), grid.size()),
                 "give frames of one camera, one plane each");
  const std::uint16_t most = codes.empty() ? std::uint16_t{0} : *std::ranges::max_element(codes);
  if (most <= largest()) return {};
  return wrong(ErrorCode::bad_value, fmt::format("code {} does not fit in {} bits", most, bits),
               "correct the bits of a code");
}

Result<void> SceneTransfer::add(Codes first, Codes second) {
  Inside& in = *inside_;
  if (!in.level) return wrong(ErrorCode::bad_argument, "frames without a level", "begin a level");
  SYMRIG_CHECK(in.check(first));
  SYMRIG_CHECK(in.check(second));
  if (!in.level->lit) {
    in.add_dark(first, second);
    return {};
  }
  const bool sorts = !in.groups;
  if (sorts) in.sort(first, second);
  if (!sorts) in.add_lit(first, second);
  in.compare_light(first, second);
  const auto taken_at = [&](const Inside::Still& one) { return same(one.exposure, in.level->exposure); };
  if (in.first_pair && std::ranges::none_of(in.bracket, taken_at))
    in.bracket.push_back({{first.begin(), first.end()}, in.level->exposure});
  in.first_pair = false;
  in.counts.lit_frames += 2;
  return {};
}

void SceneTransfer::Inside::add_dark(Codes a, Codes b) {
  counts.dark_frames += 2;
  if (dark_means.size() == 1) {
    dark.add(a);
    dark.add(b);
    dark_codes.add(a);
    dark_codes.add(b);
    return;
  }
  for (const Codes codes : {a, b}) {
    double sum = 0;
    for (const std::uint16_t code : codes) sum += code;
    dark_means.back().sum += sum / static_cast<double>(codes.size());
    dark_means.back().frames += 1;
  }
}

void SceneTransfer::Inside::sort(Codes a, Codes b) {
  sorted_at = level->exposure;
  std::vector<double> light(a.size());
  for (std::size_t i = 0; i < light.size(); ++i) light[i] = (a[i] + b[i]) / 2.0;
  dark.finish(light, largest());
  noise = std::sqrt(std::max(dark.variance(), 1.0 / 12));
  groups.emplace(a, b, dark.defects(), hdr::CodeRange{dark.pedestal(), noise, largest()});
}

void SceneTransfer::Inside::add_lit(Codes a, Codes b) {
  groups->add_points(a, b, points);
  const double factor = seconds(level->exposure) / seconds(sorted_at);
  if (factor > 1) find_clipping(a, factor);
}

/// factor: the exposure by that of the pair that sorted the pixels.
void SceneTransfer::Inside::find_clipping(Codes codes, double factor) {
  std::vector<double> beyond = groups->codes_of(codes, kBeyond * range() / factor);
  if (beyond.size() < kFewestClipped) return;
  const double spread = robust_sigma(beyond);
  if (spread > kSpreadOfClipped * std::max(noise, 0.5)) return;
  const int middle = static_cast<int>(median(beyond));
  clipping = std::min(clipping.value_or(middle), middle);
}

/// Sums over the groups that are lit, and are far from saturation at this exposure.
void SceneTransfer::Inside::compare_light(Codes a, Codes b) {
  const double factor = std::max(1.0, seconds(level->exposure) / seconds(sorted_at));
  const auto [first, second] = groups->light_of(a, b, kFarFromFull * range() / factor);
  if (!(first > 0) || !(second > 0)) return;
  lights.back().sum += first + second;
  lights.back().pairs += 1;
  flicker_squares += (second / first - 1) * (second / first - 1) / 2;
  flicker_pairs += 1;
}

Result<double> SceneTransfer::Inside::drift() const {
  double change = 0;
  for (std::size_t k = 1; k < lights.size(); ++k)
    if (lights[0].pairs > 0 && lights[k].pairs > 0 && same(lights[k].exposure, lights[0].exposure))
      change = lights[k].sum / lights[k].pairs / (lights[0].sum / lights[0].pairs) *
                   (seconds(lights[0].exposure) / seconds(lights[k].exposure)) -
               1;
  if (std::abs(change) <= kMostDrift) return change;
  return wrong(ErrorCode::limit,
               fmt::format("the light changed by {:.2g} % from the begin to the end", 100 * change),
               "let the lamp warm up, keep other light away, and measure again");
}

hdr::TransferLine SceneTransfer::Inside::fit(double pedestal, int clip) const {
  std::vector<hdr::TransferPoint> used{{dark.pedestal() - pedestal, dark.variance(), dark.samples()}};
  for (const hdr::GroupPoint& point : points)
    if (usable(point, clip))
      used.push_back({point.at.mean + dark.pedestal() - pedestal, point.at.variance, point.at.samples});
  return hdr::fit_transfer(used);
}

/// A noise model to test the linearity with: its gain is right to a factor of a few even if noise does not
/// grow with light in a straight line.
NoiseModel SceneTransfer::Inside::provisional(const hdr::TransferLine& line, double pedestal,
                                              int clip) const {
  double slope = line.slope;
  if (!line.rises()) {
    double variance = 0, mean = 0;
    for (const hdr::GroupPoint& point : points) {
      variance += point.at.samples * std::max(0.0, point.at.variance - dark.variance());
      mean += point.at.samples * std::max(0.0, point.at.mean);
    }
    slope = std::max(mean > 0 ? variance / mean : 0.0, 1e-3);
  }
  const double offset = std::max(line.rises() ? line.offset : dark.variance(), 1.0 / 12);
  const NoiseModel model = NoiseModel::from_variance_line({offset, slope, bits, pedestal});
  return clip < largest() ? model.clipped_at(clip) : model;
}

std::vector<Frame> SceneTransfer::Inside::frames() const {
  std::vector<Frame> all;
  for (const Still& still : bracket) all.push_back({still.codes, still.exposure});
  return all;
}

Result<void> SceneTransfer::Inside::recover(const NoiseModel& model, SceneSensor& found) const {
  ResponseOptions options;
  options.bits = bits;
  options.low = static_cast<int>(dark.pedestal() + kUsableSigmas * noise);
  options.high = model.saturation_code();
  SYMRIG_TRY(RecoveredResponse recovered, recover_response(frames(), options));
  found.response = std::move(recovered.curve);
  found.response_doubt = recovered.doubt;
  return {};
}

Sensor SceneTransfer::Inside::sensor_of(const hdr::TransferLine& line, double pedestal, int clip) const {
  Sensor sensor;
  hdr::set_noise(sensor, line, bits, pedestal, clip);
  sensor.dsnu = dark.dsnu();
  sensor.defects = Image<std::uint8_t>(grid);
  std::ranges::copy(dark.defects(), sensor.defects.values().begin());
  return sensor;
}

/// fails: bad_value (no light between dark and saturation).
Result<void> SceneTransfer::Inside::check_light(int clip) const {
  double most = 0;
  for (const hdr::GroupPoint& point : points)
    if (usable(point, clip)) most = std::max(most, point.at.mean);
  if (most >= kLeastLight * (clip - dark.pedestal())) return {};
  return wrong(
      ErrorCode::bad_value,
      fmt::format("no pixels are between the dark level, {:.0f} DN, and saturation", dark.pedestal()),
      "take frames whose brightest parts are at a tenth to two thirds of the range");
}

Result<SceneSensor> SceneTransfer::finish() {
  Inside& in = *inside_;
  if (!in.groups)
    return wrong(ErrorCode::bad_argument, "there are no lit frames", "give two or more of the lit scene");
  SceneSensor found;
  static_cast<SceneFacts&>(found) = in.counts;
  found.grid = in.grid;
  in.dark_means.front().sum = in.dark.mean() * in.dark.frames();
  in.dark_means.front().frames = in.dark.frames();
  const auto dark = in.fit_dark();
  found.dark_signal = dark.rate;
  found.dark_signal_sigma = dark.rate_sigma;
  found.flicker = in.flicker_pairs > 0 ? std::sqrt(in.flicker_squares / in.flicker_pairs) : 0;
  found.clipping_seen = in.clipping.has_value();
  const int clipping = in.clipping.value_or(in.largest());
  SYMRIG_CHECK(in.check_light(clipping));
  SYMRIG_TRY(found.drift, in.drift());
  const double pedestal =
      std::max(0.0, in.dark.pedestal() - dark.rate * seconds(in.dark_means.front().exposure));
  const hdr::TransferLine line = in.fit(pedestal, clipping);
  const NoiseModel model = in.provisional(line, pedestal, clipping);
  SYMRIG_TRY(found.linearity, test_linearity(in.frames(), model));
  if (!found.linearity.linear()) SYMRIG_CHECK(in.recover(model, found));
  if (found.linearity.linear()) SYMRIG_CHECK(in.dark_codes.check());
  if (line.rises()) {
    found.sensor = in.sensor_of(line, pedestal, clipping);
    found.sensor->nonlinearity = found.linearity.worst;
    found.sensor->clipping_seen = found.clipping_seen;
  } else if (found.linearity.linear()) {
    return wrong(ErrorCode::bad_value, "the noise of the frames does not grow with their light",
                 "take raw frames, not processed ones");
  }
  return found;
}

}  // namespace symrig
