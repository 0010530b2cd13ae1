// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/registration.hpp"

#include "calibration/camera_optics/combs.hpp"
#include "calibration/photograph_each.hpp"
#include "calibration/registration/registration_steps.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/calibration/registered_probe.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

namespace symrig {

using calibration::check_maps;
using calibration::fit_maps;
using calibration::seen_cells;
using calibration::ShiftField;

namespace {

/// Errors of the map are normal, so nearly none is three times the rms.
constexpr double kMarginErrors = 3;

/// The mean of white and of each pattern plus its complement. photographs: of a Gray code, in order.
Radiance mean_flood(const GrayCode& code, std::span<const Radiance> photographs) {
  return calibration::scaled_sum(photographs.first(static_cast<std::size_t>(code.white()) + 1),
                                 static_cast<float>(1.0 / (code.pairs() + 1)));
}

Result<void> add_gain(Probe& rig, Registration& found, const Progress& progress) {
  SYMRIG_TRY(CellWeights weights, found.bare_weights());
  SYMRIG_TRY(const Image<std::uint8_t> seen, seen_cells(weights, found.flood));
  RegisteredProbe probe(rig, std::move(weights));
  SYMRIG_TRY(found.gain, measure_gain_ratio(probe, seen, progress));
  return {};
}

Result<void> add_stripes(Probe& rig, Registration& found) {
  SYMRIG_TRY(const auto photographs, rig.measure(MotionWatch::patterns(found.cells)));
  const int channels = found.flood.mean.channels();
  found.stripes = Image<float>(found.camera(), 2 * channels);
  for (int k = 0; k < 2; ++k)
    for (int c = 0; c < channels; ++c)
      std::ranges::copy(photographs[static_cast<std::size_t>(k)].mean.plane(c),
                        found.stripes.plane(k * channels + c).begin());
  return {};
}

/// rms along an axis, over the points of a lattice that look at a cell [cells].
double rms_distance(const CameraMap& one, const CameraMap& other, Grid cells) {
  constexpr int kPoints = 40;
  double square = 0;
  int count = 0;
  for (int row = 0; row < kPoints; ++row)
    for (int col = 0; col < kPoints; ++col) {
      const Point at{(row + 0.5) * one.camera().rows / kPoints, (col + 0.5) * one.camera().cols / kPoints};
      const Point a = one.look(at), b = other.look(at);
      if (!(a.row >= 0 && a.col >= 0 && a.row <= cells.rows && a.col <= cells.cols)) continue;
      square += std::pow(a.row - b.row, 2) + std::pow(a.col - b.col, 2);
      count += 2;
    }
  return count > 0 ? std::sqrt(square / count) : 0;
}

/// Corrects the maps by what the combs still show of a shift. A field is shrunk by its noise, so there are a
/// few rounds.
Result<void> add_reciprocity(const CombPhotographs& combs, Registration& found) {
  constexpr int kMostRounds = 4;
  if (!found.blur.measured || combs.rows.empty()) return {};
  const std::vector<CameraMap> before = found.maps;
  ReciprocalShift& result = found.reciprocity;
  for (int round = 0; round < kMostRounds; ++round) {
    SYMRIG_TRY(const CellWeights weights, found.weights());
    SYMRIG_TRY(const Image<std::uint8_t> seen, seen_cells(weights, found.flood));
    SYMRIG_TRY(const auto rows, calibration::gathered(weights, combs.rows));
    SYMRIG_TRY(const auto columns, calibration::gathered(weights, combs.columns));
    bool changed = false;
    double left = 0;
    for (std::size_t k = 0; k < found.maps.size(); ++k) {
      std::vector<int> channels;
      for (int c = 0; c < weights.channels(); ++c)
        if (found.maps.size() == 1 || std::cmp_equal(c, k)) channels.push_back(c);
      const ShiftField down(rows, seen, true, channels), right(columns, seen, false, channels);
      left = std::max(left, std::hypot(down.unknown(), right.unknown()) / std::numbers::sqrt2);
      if (!down.found() && !right.found()) continue;
      changed = true;
      found.maps[k] = found.maps[k].shifted([&](Point cell) { return Point{down(cell), right(cell)}; });
    }
    result.left = left;
    result.measured = true;
    if (!changed) break;
  }
  for (std::size_t k = 0; k < found.maps.size(); ++k)
    result.corrected = std::max(result.corrected, rms_distance(before[k], found.maps[k], found.cells));
  return {};
}

/// The map of a camera with more pixels than cells.
Result<Registration> register_own_pixels(Probe& rig, const RegistrationOptions& options) {
  SYMRIG_TRY(auto photographs, calibration::photograph_each(rig, gray_code_patterns(rig.grid()), "Gray code",
                                                            options.progress));
  Registration found;
  found.cells = rig.grid();
  found.flood = mean_flood(GrayCode(found.cells), photographs);
  SYMRIG_CHECK(fit_maps(photographs, found));
  const Registration first = found;
  SYMRIG_CHECK(calibration::add_ghost(
      {rig, first}, {&photographs, 1}, [&] { return fit_maps(photographs, found); }, options.progress,
      found));
  SYMRIG_CHECK(check_maps(found, options));
  return found;
}

}  // namespace

double Registration::error() const {
  double worst = 0;
  for (const CameraMap& map : maps) worst = std::max(worst, map.error());
  return worst;
}

std::vector<CornerMap> Registration::corners() const {
  std::vector<CornerMap> corners;
  corners.reserve(maps.size());
  for (const CameraMap& map : maps) corners.push_back(map.corners());
  return corners;
}

MapShape Registration::shape() const {
  constexpr double kUnseen = 0.01;  // of the light of bright pixels
  const CameraMap& map = maps[maps.size() / 2];
  const auto light = flood.mean.plane(maps.size() > 1 ? static_cast<int>(maps.size() / 2) : 0);
  const double bright = quantile(std::vector<double>(light.begin(), light.end()), 0.99);
  const auto known = [&](Point at) {
    const std::int64_t pixel =
        std::int64_t{1} * static_cast<int>(at.row) * camera().cols + static_cast<int>(at.col);
    return static_cast<double>(light[pixel]) >= kUnseen * bright;
  };
  return shape_of(
      camera(), [&map](Point at) { return map.look(at); }, cells, known);
}

MotionWatch Registration::watch(Mosaic mosaic) const {
  return {cells, stripes, maps.front().step(), mosaic};
}

double Registration::edge_blur() const {
  double widest = 0;
  for (const CameraMap& map : maps) widest = std::max(widest, map.edge_blur());
  return widest;
}

double Registration::pixels_per_cell() const {
  double fewest = maps.front().pixels_per_cell();
  for (const CameraMap& map : maps) fewest = std::min(fewest, map.pixels_per_cell());
  return fewest;
}

double Registration::margin() const {
  return kMarginErrors * error();
}

Result<CellWeights> Registration::weights() const {
  SYMRIG_TRY(CellWeights weights, bare_weights());
  if (gain.known) SYMRIG_CHECK(weights.divide_by(gain.over(cells)));
  SYMRIG_CHECK(weights.blur_by(blur.missing(weights.pixel_side())));
  return weights;
}

Result<CellWeights> Registration::weights_of_mosaic(const BayerPattern& filters) const {
  const auto refused = [](const char* cause, const char* next) {
    return Error{ErrorCode::bad_argument, fmt::format("no colour can be gathered from the mosaic: {}", cause),
                 next};
  };
  if (shift || flood.mean.channels() != 1)
    return refused("the registration is not of one channel with several pixels in a cell",
                   "use a camera with 4.4 pixels along the side of a cell");
  if (ghost.found) return refused("the rig has a ghost", "remove the ghost, or capture without colour");
  const WeightOptions options{.weighting = weighting(), .margin = margin()};
  SYMRIG_TRY(CellWeights weights, CellWeights::of_mosaic(cells, corners(), flood, filters, options, &shares));
  if (blur.missing(weights.pixel_side()) > 0)
    return refused("camera and projector are not equally sharp",
                   "focus the projector, or capture without colour");
  if (gain.known) SYMRIG_CHECK(weights.divide_by(gain.over(cells)));
  return weights;
}

Weighting Registration::weighting() const {
  if (shift) return Weighting::unmixed;
  return blur.measured ? Weighting::area : Weighting::cores;
}

Result<CellWeights> Registration::bare_weights() const {
  if (shift) {
    SYMRIG_TRY(CellWeights weights, CellWeights::unmixing(cells, flood.mean.channels(), *shift));
    if (ghost.found) SYMRIG_CHECK(weights.subtract_ghost(corners(), ghost));
    return weights;
  }
  WeightOptions options;
  options.weighting = weighting();
  options.margin = margin();
  return calibration::weights_without_ghost(cells, corners(), flood, ghost, options, &shares);
}

Result<Registration> register_camera(Probe& rig, const RegistrationOptions& options) {
  const std::int64_t before = rig.cost().photographs;
  const bool shared = rig.camera_grid() == rig.grid(), one_view = rig.views().single();
  SYMRIG_TRY(Registration found, shared     ? calibration::register_shared_grid(rig, options)
                                 : one_view ? register_own_pixels(rig, options)
                                            : calibration::register_views(rig, options));
  found.rig = rig.describe();
  SYMRIG_CHECK(add_stripes(rig, found));
  CombPhotographs combs;
  if (!shared && one_view && calibration::is_blurred(found, false)) {
    SYMRIG_TRY(combs, photograph_combs(rig, options.progress));
    SYMRIG_CHECK(calibration::add_blur(combs, found));
  }
  SYMRIG_CHECK(add_gain(rig, found, options.progress));
  if (options.refine) SYMRIG_CHECK(add_reciprocity(combs, found));
  found.photographs = rig.cost().photographs - before;
  return found;
}

Result<void> require_coaxial(const Parallax& parallax) {
  if (parallax.range <= kMostParallax) return {};
  return Error{
      ErrorCode::bad_value,
      fmt::format("camera and projector are not coaxial: near and far parts of the scene are {:.1f} cells "
                  "apart in the map, and {:.1f} is the most that a symmetric transport allows",
                  parallax.range, kMostParallax),
      "align them with symrig align, or make the cells larger"};
}

std::optional<ExpectedIndirect> expected_indirect(const Registration& registration, ViewLayout views) {
  constexpr double kSurfaces = 0.22, kScattering = 1.1;
  if (!views.single() || registration.weighting() != Weighting::cores) return std::nullopt;
  const double pixels = registration.pixels_per_cell();
  return ExpectedIndirect{kSurfaces / pixels, kScattering / (pixels * pixels)};
}

}  // namespace symrig
