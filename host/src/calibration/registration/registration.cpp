// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/registration.hpp"

#include "calibration/registration/comb_blur.hpp"
#include "calibration/registration/comb_pairs.hpp"
#include "calibration/registration/fitted_maps.hpp"
#include "calibration/registration/ghost_subtraction.hpp"
#include "calibration/registration/photograph_each.hpp"
#include "calibration/registration/reciprocal_shift.hpp"
#include "calibration/registration/register_views.hpp"
#include "calibration/registration/scaled_sum.hpp"
#include "calibration/registration/shared_grid.hpp"
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
using calibration::ShiftField;

namespace {

/// Errors of the map are normal, so nearly none is three times the rms.
constexpr double kMarginErrors = 3;
/// [cells] Of edge_blur(). From here on, both blurs are measured: it is what edges show of a blur of 0.09.
constexpr double kLeastBlur = 0.02;
/// Of OpticsBlur::far. A blur of 0.2 cells gives less than 0.02, and indirect light in sharp grooves 0.01.
/// Scattering below the surface gives 0.1 and more, and leaves edges sharp.
constexpr double kScattered = 0.05;
/// Edges show a blur of 0.2 cells and more to a tenth. A smaller one gives next to no far light.
constexpr double kEdgesMiss = 1.5;

/// The mean of white and of each pattern plus its complement. photographs: of a Gray code, in order.
Radiance mean_flood(const GrayCode& code, std::span<const Radiance> photographs) {
  return calibration::scaled_sum(photographs.first(static_cast<std::size_t>(code.white()) + 1),
                                 static_cast<float>(1.0 / (code.pairs() + 1)));
}

/// 1 for the cells that the camera sees in all channels. A cell that one channel does not see would be lit
/// and not seen.
Result<Image<std::uint8_t>> seen_cells(const CellWeights& weights, const Radiance& flood) {
  SYMRIG_TRY(const Radiance cells, weights.gather(flood));
  Image<std::uint8_t> seen(weights.cells(), 1, std::uint8_t{1});
  for (int c = 0; c < cells.valid.channels(); ++c)
    for (std::size_t i = 0; i < seen.values().size(); ++i) seen.values()[i] &= cells.valid.plane(c)[i];
  return seen;
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

/// Weights of a registration on a grid of `cells`, without its ghost. corners, ghost: on that grid.
Result<CellWeights> weights_without_ghost(Grid cells, const std::vector<CornerMap>& corners,
                                          const Radiance& flood, const CameraGhost& ghost,
                                          const WeightOptions& options, const Image<float>* shares) {
  if (!ghost.found) return CellWeights::make(cells, corners, flood, options, shares);
  SYMRIG_TRY(const Radiance plain, without_ghost(flood, corners, ghost));
  SYMRIG_TRY(CellWeights weights, CellWeights::make(cells, corners, plain, options, shares));
  SYMRIG_CHECK(weights.subtract_ghost(corners, ghost));
  return weights;
}

/// Photographs on the camera's grid, without the ghost of the registration.
Result<std::vector<Radiance>> without_its_ghost(const Registration& found, std::span<const CornerMap> corners,
                                                std::span<const Radiance> photographs) {
  std::vector<Radiance> plain;
  plain.reserve(photographs.size());
  for (const Radiance& one : photographs) {
    SYMRIG_TRY(Radiance without, found.ghost.found ? without_ghost(one, corners, found.ghost) : Result(one));
    plain.push_back(std::move(without));
  }
  return plain;
}

/// Fits both blurs to the camera's pixels.
Result<OpticsBlur> blur_of_pixels(const CombPhotographs& combs, const Registration& found) {
  const std::vector<CornerMap> corners = found.corners();
  SYMRIG_TRY(const auto flood, without_its_ghost(found, corners, {&found.flood, 1}));
  CombPhotographs plain;
  SYMRIG_TRY(plain.rows, without_its_ghost(found, corners, combs.rows));
  SYMRIG_TRY(plain.columns, without_its_ghost(found, corners, combs.columns));
  return calibration::fit_comb_blur({found.cells, corners, flood.front(), plain}, found.blur);
}

Result<void> add_blur(const CombPhotographs& combs, Registration& found) {
  std::vector<CornerMap> corners = found.corners();
  const WeightOptions by_area{.weighting = Weighting::area};
  SYMRIG_TRY(const CellWeights weights,
             weights_without_ghost(found.cells, corners, found.flood, found.ghost, by_area, nullptr));
  for (CornerMap& map : corners)
    for (double& v : map.values()) v *= 2;
  CameraGhost ghost = found.ghost;
  ghost.place = {2 * ghost.place.row, 2 * ghost.place.col};
  SYMRIG_TRY(const CellWeights halves, weights_without_ghost({2 * found.cells.rows, 2 * found.cells.cols},
                                                             corners, found.flood, ghost, by_area, nullptr));
  SYMRIG_TRY(const Radiance flood, halves.gather(found.flood));
  SYMRIG_TRY(const Image<std::uint8_t> seen, seen_cells(weights, found.flood));
  SYMRIG_TRY(found.blur, measure_blur(combs, {weights, halves, flood.mean, seen}));
  // Light that scatters below the surface gets to the next cell too, but farther, and it leaves edges sharp.
  if (found.blur.far > kScattered + OpticsBlur::far_light(kEdgesMiss * found.edge_blur()))
    found.blur = OpticsBlur{.far = found.blur.far};
  if (found.blur.measured) {
    SYMRIG_TRY(found.blur, blur_of_pixels(combs, found));
  }
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

/// Pixels beyond the cells see little but the ghost: they tell where that is, not where they look. The ghost
/// is known to some hundredths, so half of a pixel's light of its own is enough. flood: with the ghost;
/// plain: without.
void leave_out_ghosts(const Radiance& flood, const Radiance& plain, std::vector<Radiance>& photographs) {
  constexpr float kOwnLight = 0.5F;
  for (std::size_t i = 0; i < flood.mean.values().size(); ++i) {
    if (plain.mean.values()[i] > kOwnLight * flood.mean.values()[i]) continue;
    for (Radiance& one : photographs)
      one.mean.values()[i] = 0, one.variance.values()[i] = 0, one.valid.values()[i] = 0;
  }
}

/// Looks for a ghost. Subtracts it from the photographs of the Gray code, and fits the maps again.
Result<void> add_ghost(Probe& rig, Registration& found, std::vector<Radiance>& photographs,
                       const Progress& progress) {
  std::vector<CornerMap> corners = found.corners();
  SYMRIG_TRY(const CellWeights by_area,
             CellWeights::make(found.cells, corners, found.flood, {.weighting = Weighting::area}));
  SYMRIG_TRY(found.ghost, measure_ghost(rig, by_area, corners, progress));
  if (!found.ghost.found) return {};
  // At the border, the first map follows the ghost, and so does a little of the second. So two maps without
  // the pixels that see it come first.
  for (const bool subtracted : {false, false, true}) {
    SYMRIG_TRY(const auto subtract,
               calibration::GhostSubtraction::make(corners, found.ghost.share, found.ghost.place));
    if (subtracted)
      for (Radiance& one : photographs) one = subtract(one);
    leave_out_ghosts(found.flood, subtract(found.flood), photographs);
    SYMRIG_CHECK(fit_maps(photographs, found));
    corners = found.corners();
  }
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
  SYMRIG_CHECK(add_ghost(rig, found, photographs, options.progress));
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
  const CameraMap& map = maps[maps.size() / 2];
  return shape_of(
      camera(), [&map](Point at) { return map.look(at); }, cells);
}

MotionWatch Registration::watch() const {
  return {cells, stripes, maps.front().step()};
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

Weighting Registration::weighting() const {
  if (shift) return Weighting::unmixed;
  return blur.measured ? Weighting::area : Weighting::cores;
}

Result<CellWeights> Registration::bare_weights() const {
  if (shift) return CellWeights::unmixing(cells, flood.mean.channels(), *shift);
  WeightOptions options;
  options.weighting = weighting();
  options.margin = margin();
  return weights_without_ghost(cells, corners(), flood, ghost, options, &shares);
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
  if (!shared && one_view && found.edge_blur() > kLeastBlur) {
    SYMRIG_TRY(combs, photograph_combs(rig, options.progress));
    SYMRIG_CHECK(add_blur(combs, found));
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

}  // namespace symrig
