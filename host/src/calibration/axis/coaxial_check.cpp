// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/coaxial_check.hpp"

#include "calibration/axis/coaxial_comb.hpp"
#include "calibration/photograph_each.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include <fmt/format.h>

namespace symrig {

double Estimate::significance() const {
  return sigma > 0 ? std::abs(value) / sigma : 0;
}

namespace {

using calibration::Comb;
using calibration::CombAxis;
using calibration::CombLight;
using calibration::DoubleImage;
using calibration::Flare;
using calibration::Imbalance;

constexpr int kNear = 3;     // pixels; the distances that a shift of up to largest_shift reaches
constexpr int kBlurred = 2;  // pixels around a second picture that receive some of its light
/// Photographs are floats, so even without noise their sums are only known to this share of the light.
constexpr double kRounding = 1e-6;
/// Uncertainty of the fitted flare profile, as a share of the flare at near distances and in all.
constexpr double kProfileError = 0.25;
/// kScaleError: relative uncertainty of a shift's scale from the texture of the stripes. kSmoothError: this
/// share of the smooth light within three pixels may be direct light.
constexpr double kScaleError = 0.1, kSmoothError = 0.5;
/// A shift of one pixel looks like a flare of at most this share, because it also moves indirect light. A
/// curved mirror showed half as much, matt scenes a tenth.
constexpr double kFlareOfShift = 1;
/// No flare is a larger share of the light.
constexpr double kLargestFlare = 0.2;

bool lit(const CombLight& light) {
  return light.value > 5 * std::sqrt(light.variance);
}

/// r(d) of every pair of stripes, over the direct light: light that went d pixels up the axis, minus light
/// that went d pixels down it. Empty if the direct light is not above the noise.
std::vector<Imbalance> imbalances(const Comb& comb, std::span<const Radiance> photographs) {
  std::vector<Imbalance> found;
  for (std::size_t i = 0; i < photographs.size(); ++i) {
    for (std::size_t j = i + 1; j < photographs.size(); ++j) {
      const CombLight up = light_at(photographs[i], comb, comb.offsets[j]);
      const CombLight down = light_at(photographs[j], comb, comb.offsets[i]);
      const CombLight a = direct_light(photographs[i], comb, comb.offsets[i]);
      const CombLight b = direct_light(photographs[j], comb, comb.offsets[j]);
      if (!lit(a) || !lit(b)) return {};
      // Divide by the direct light of the stripes that the difference comes from: then their texture adds no
      // error.
      const double difference = up.value - down.value, direct = difference > 0 ? a.value : b.value;
      const double noise = std::sqrt(up.variance + down.variance) / direct;
      found.push_back({comb.offsets[j] - comb.offsets[i], difference / direct, std::hypot(noise, kRounding)});
    }
  }
  return found;
}

/// Relative error of a shift: the relative error of the direct light that scales it.
double scale_error(const Comb& comb, std::span<const Radiance> photographs) {
  double most = 0;
  for (std::size_t i = 0; i < photographs.size(); ++i)
    most = std::max(most, smooth_share(photographs[i], comb, comb.offsets[i]));
  return std::hypot(kScaleError, kSmoothError * most);
}

/// −Σ_{d ≤ 3} d (r(d) − flare(d)). A shift of indirect light looks like a flare that is smaller than the
/// shift. Such a flare is not subtracted; it makes the shift less certain.
Estimate first_moment(std::span<const Imbalance> found, const Flare& flare, const Comb& comb,
                      double scale_error) {
  Estimate shift;
  double variance = 0, corrected = 0;
  for (const Imbalance& one : found) {
    if (one.distance > kNear) continue;  // each distance occurs once (make_comb)
    const double light = flare.share * flare_imbalance(comb, one.distance, flare.length);
    shift.value -= one.distance * one.value;
    corrected += one.distance * light;
    variance += one.distance * one.distance * one.sigma * one.sigma;
  }
  double open = std::min(std::abs(corrected), kLargestFlare);
  if (std::abs(flare.share) < kLargestFlare &&
      std::abs(flare.share) > kFlareOfShift * std::abs(shift.value)) {
    shift.value += corrected;
    open = kProfileError * std::abs(corrected);
  }
  shift.sigma = std::sqrt(variance + open * open + std::pow(scale_error * shift.value, 2));
  return shift;
}

/// Whether two stripes at this distance exchange light of a second picture.
bool sees(const DoubleImage& second, int distance, const Comb& comb) {
  if (second.shift == 0) return false;
  const int off = std::abs(std::abs(second.shift) - distance) % comb.period;
  const int other = (std::abs(second.shift) + distance) % comb.period;
  return std::min({off, comb.period - off, other, comb.period - other}) <= kBlurred;
}

/// The flare is measured on the far stripes, which a shift does not reach. Without a shift it is measured on
/// all stripes. Stripes that a second picture reaches are never used.
AxisCheck judge_axis(std::span<const Imbalance> found, const Comb& comb, const DoubleImage& second,
                     double sigmas, double scale_error) {
  std::vector<Imbalance> far, usable;
  for (const Imbalance& one : found) {
    if (sees(second, one.distance, comb)) continue;
    usable.push_back(one);
    if (one.distance > kNear) far.push_back(one);
  }
  Flare flare = fit_flare(far, comb);
  if (flare.significance < sigmas) flare = {};
  AxisCheck axis;
  axis.measured = true;
  axis.shift = first_moment(found, flare, comb, scale_error);
  if (axis.shift.significance() < sigmas) flare = fit_flare(usable, comb);
  axis.flare = {flare.share, std::hypot(flare.sigma, kProfileError * flare.share)};
  axis.flare_length = flare.length;
  axis.flare_significance = flare.significance;
  axis.second = {second.share, second.sigma};
  axis.second_shift = second.shift;
  return axis;
}

bool finite(const Radiance& photograph) {
  const auto mean = photograph.mean.values(), variance = photograph.variance.values();
  for (std::size_t i = 0; i < mean.size(); ++i)
    if (photograph.valid.values()[i] != 0 && !(std::isfinite(mean[i]) && std::isfinite(variance[i])))
      return false;
  return true;
}

Result<std::vector<Radiance>> show(Probe& probe, const Comb& comb, std::span<const int> offsets,
                                   const Progress& progress) {
  std::vector<Pattern> patterns;
  for (const int offset : offsets) patterns.push_back(comb.pattern(offset));
  // A rig that computes takes all of them at once in a moment.
  SYMRIG_TRY(auto photographs,
             progress && !probe.computes()
                 ? calibration::photograph_each(probe, patterns, "check of the axis", progress)
                 : probe.measure(patterns));
  if (photographs.size() != patterns.size())
    return Error{ErrorCode::frame_missing, fmt::format("the rig answered {} patterns with {} photographs",
                                                       patterns.size(), photographs.size())};
  if (!std::ranges::all_of(photographs, finite))
    return Error{ErrorCode::bad_value, "a photograph contains NaN or infinity in a valid pixel",
                 "check the camera and the merge"};
  return photographs;
}

/// Looks for a second picture, and measures it if one is suspected.
Result<DoubleImage> find_double_image(Probe& probe, const Comb& comb, std::span<const Radiance> photographs,
                                      CoaxialCheck& check) {
  const auto distance =
      calibration::suspect_double_image(comb, photographs, check.options.smallest_second / 2);
  if (!distance) return DoubleImage{};
  SYMRIG_TRY(const auto there,
             show(probe, comb, std::array{comb.offsets.front() + *distance}, check.options.progress));
  ++check.photographs;
  return calibration::prove_double_image(comb, photographs, there.front(), *distance);
}

bool doubles(const DoubleImage& second, const CoaxialOptions& options) {
  constexpr double kMost = 1;  // the second picture is the fainter one
  return second.share < kMost &&
         second.share > std::max(options.sigmas * second.sigma, options.smallest_second);
}

/// The result for an axis whose stripes appear more than three pixels from where they were shown. Nothing if
/// they appear in place, or not at all.
std::optional<AxisCheck> shifted_beyond(const Comb& comb, std::span<const Radiance> photographs) {
  const auto distance =
      calibration::light_elsewhere(comb, photographs, static_cast<int>(CoaxialCheck::largest_shift));
  if (!distance) return std::nullopt;
  CombLight there;
  for (std::size_t i = 0; i < photographs.size(); ++i) {
    const CombLight one = direct_light(photographs[i], comb, comb.offsets[i] + *distance);
    there.value += one.value, there.variance += one.variance;
  }
  if (!lit(there)) return std::nullopt;
  AxisCheck axis;
  axis.measured = axis.beyond = true;
  axis.shift = {static_cast<double>(-*distance), 1};
  return axis;
}

Result<AxisCheck> check_axis(Probe& probe, CombAxis which, CoaxialCheck& check) {
  const auto comb = calibration::make_comb(which, probe.grid());
  if (!comb) return AxisCheck{};
  SYMRIG_TRY(const auto photographs, show(probe, *comb, comb->offsets, check.options.progress));
  check.photographs += std::ssize(photographs);
  if (const auto beyond = shifted_beyond(*comb, photographs)) return *beyond;
  const auto found = imbalances(*comb, photographs);
  if (found.empty()) return AxisCheck{};
  for (const Imbalance& one : found)
    if (std::abs(one.value) > std::abs(check.reciprocity.value)) check.reciprocity = {one.value, one.sigma};
  SYMRIG_TRY(DoubleImage second, find_double_image(probe, *comb, photographs, check));
  if (!doubles(second, check.options)) second = {};
  return judge_axis(found, *comb, second, check.options.sigmas, scale_error(*comb, photographs));
}

bool shifted(const AxisCheck& axis, const CoaxialOptions& options) {
  return axis.beyond || (axis.measured && axis.shift.significance() > options.sigmas &&
                         std::abs(axis.shift.value) > options.smallest_shift);
}

bool flares(const AxisCheck& axis, const CoaxialOptions& options) {
  const double passes = shifted(axis, options) ? kFlareOfShift * std::abs(axis.shift.value) : 0;
  return axis.measured && axis.flare_significance > options.sigmas &&
         std::abs(axis.flare.value) > options.smallest_flare + passes;
}

/// Whether an axis has a second picture. A shift also moves indirect light, and sharp parts of it look like a
/// second picture.
bool doubled_along(const AxisCheck& axis, const CoaxialOptions& options) {
  const double passes = shifted(axis, options) ? kFlareOfShift * std::abs(axis.shift.value) : 0;
  return axis.measured && axis.second_shift != 0 && axis.second.value > passes;
}

/// "+0.098 +- 0.010": as many digits as sigma allows; never "-0.000".
std::string text_of(const Estimate& estimate) {
  const int digits =
      estimate.sigma > 0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(estimate.sigma))), 0, 6) : 6;
  const double unit = std::pow(10.0, -digits);
  const double rounded = std::round(estimate.value / unit) * unit + 0.0;
  return fmt::format("{:+.{}f} +- {:.{}f}", rounded, digits, estimate.sigma, digits);
}

/// "+0.098 +- 0.010 pixels down", "about 5 pixels up"
std::string name_axis(const AxisCheck& axis, const char* back, const char* ahead) {
  if (!axis.beyond) return text_of(axis.shift) + " pixels " + ahead;
  return fmt::format("about {:.0f} pixels {}", std::abs(axis.shift.value),
                     axis.shift.value < 0 ? back : ahead);
}

std::string name_shift(const CoaxialCheck& check) {
  std::string text;
  if (check.rows.measured) text += name_axis(check.rows, "up", "down");
  if (check.rows.measured && check.cols.measured) text += " and ";
  if (check.cols.measured) text += name_axis(check.cols, "to the left", "to the right");
  return text;
}

std::string name_misalignment(const CoaxialCheck& check) {
  const std::string text =
      "misaligned: the camera looks " + name_shift(check) + " of where the projector shines; ";
  if (!check.rows.beyond && !check.cols.beyond) return text + "align the rig or calibrate it";
  return text +
         fmt::format(
             "this is beyond the {:g} pixels that this check measures: align the rig, then check again",
             CoaxialCheck::largest_shift);
}

/// The flare along one axis: "1.0 +- 0.3 % upwards over about 7 pixels".
std::string name_flare(const AxisCheck& axis, const char* back, const char* ahead) {
  return fmt::format("{:.2g} +- {:.1g} % {} over about {:.0f} pixels", 100 * std::abs(axis.flare.value),
                     100 * axis.flare.sigma, axis.flare.value < 0 ? back : ahead, axis.flare_length);
}

/// "2.0 +- 0.1 % of the light appears a second time, 9 pixels to the right"
std::string name_second(const AxisCheck& axis, const char* back, const char* ahead) {
  return fmt::format("{:.2g} +- {:.1g} % of the light appears a second time, {} pixels {}",
                     100 * axis.second.value, 100 * axis.second.sigma, std::abs(axis.second_shift),
                     axis.second_shift < 0 ? back : ahead);
}

std::string name_seconds(const CoaxialCheck& check) {
  std::string text;
  if (doubled_along(check.rows, check.options)) text += name_second(check.rows, "upwards", "downwards");
  if (!doubled_along(check.cols, check.options)) return text;
  return (text.empty() ? "" : text + ", and ") + name_second(check.cols, "to the left", "to the right");
}

std::string name_flares(const CoaxialCheck& check) {
  std::string text;
  if (flares(check.rows, check.options)) text += name_flare(check.rows, "upwards", "downwards");
  if (!flares(check.cols, check.options)) return text;
  return (text.empty() ? "" : text + ", ") + name_flare(check.cols, "to the left", "to the right");
}

}  // namespace

bool CoaxialCheck::misaligned() const {
  return shifted(rows, options) || shifted(cols, options);
}

bool CoaxialCheck::flaring() const {
  return flares(rows, options) || flares(cols, options);
}

bool CoaxialCheck::doubled() const {
  return doubled_along(rows, options) || doubled_along(cols, options);
}

std::string CoaxialCheck::to_string() const {
  if (!measured()) return "coaxial check: not possible, too few pixels or too little light";
  const std::string shift = "the camera looks " + name_shift(*this) + " of where the projector shines";
  std::vector<std::string> found;
  if (misaligned()) found.push_back(name_misalignment(*this));
  if (doubled())
    found.push_back("double image: " + name_seconds(*this) +
                    "; look for a second reflecting surface (beam splitter, filter, window)");
  if (flaring())
    found.push_back("asymmetry: more light goes than comes back, by " + name_flares(*this) +
                    "; it fits a one-sided flare (clean the lenses, shade them from stray light), unequal "
                    "focus of camera and projector, brightness that falls off towards the border of one of "
                    "them, and pictures resampled from another grid");
  return found.empty() ? "coaxial: " + shift : fmt::format("{}", fmt::join(found, ". "));
}

Result<CoaxialCheck> check_coaxial(Probe& probe, const CoaxialOptions& options) {
  SYMRIG_CHECK(check_aligned(probe));
  CoaxialCheck check;
  check.options = options;
  SYMRIG_TRY(check.rows, check_axis(probe, CombAxis::rows, check));
  SYMRIG_TRY(check.cols, check_axis(probe, CombAxis::cols, check));
  return check;
}

Result<void> require_coaxial(Probe& probe, const CoaxialOptions& options) {
  SYMRIG_TRY(const CoaxialCheck check, check_coaxial(probe, options));
  if (!check.misaligned() && !check.flaring() && !check.doubled()) return {};
  return Error{ErrorCode::bad_value, check.to_string(), "repair the rig"};
}

}  // namespace symrig
