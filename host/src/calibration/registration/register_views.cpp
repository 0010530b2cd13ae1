// SPDX-License-Identifier: Apache-2.0
#include "calibration/cells/ghost_subtraction.hpp"
#include "calibration/photograph_each.hpp"
#include "calibration/registration/registration_steps.hpp"
#include "calibration/registration/views.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/calibration/registration.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

/// One view of a rig of several, as a rig of its own: patterns are on the cells of its tile. Only the pixels
/// that belong to the view are valid in photographs, because others see the same points from elsewhere.
class OneView final : public Probe {
 public:
  /// rig, own: must outlive this.
  OneView(Probe& rig, const OwnViews& own, View view)
      : rig_(rig), own_(own), view_(view), tile_(rig.views().tile(rig.grid(), view)) {}

  Grid grid() const override { return tile_.grid; }
  Grid camera_grid() const override { return rig_.camera_grid(); }
  int channels() const override { return rig_.channels(); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override;
  ProbeCost cost() const override { return rig_.cost(); }
  std::string describe() const override { return rig_.describe(); }

  /// From now on, photographs have no ghost. It is subtracted before pixels become invalid, because the ghost
  /// of a pixel near the border of a view comes from pixels of another one.
  void subtract(GhostSubtraction ghost) { ghost_ = std::move(ghost); }
  /// The registration of this view: the maps of `whole` on the cells of the tile, and no ghost.
  /// lit: photograph of the view, lit whole and alone, with its ghost.
  Registration part_of(const Registration& whole, const Radiance& lit) const;

 private:
  Radiance of_view(Radiance photograph) const;

  Probe& rig_;
  const OwnViews& own_;
  View view_;
  Tile tile_;
  std::optional<GhostSubtraction> ghost_;
};

Result<std::vector<Radiance>> OneView::measure(std::span<const Pattern> patterns) {
  SYMRIG_CHECK(check_patterns(*this, patterns));
  std::vector<Pattern> inside;
  inside.reserve(patterns.size());
  for (const Pattern& pattern : patterns) {
    Pattern& whole = inside.emplace_back(rig_.grid());
    for (int row = 0; row < tile_.grid.rows; ++row)
      for (int col = 0; col < tile_.grid.cols; ++col)
        whole.at(tile_.row + row, tile_.col + col) = pattern.at(row, col);
  }
  SYMRIG_TRY(auto photographs, rig_.measure(inside));
  for (Radiance& one : photographs) one = of_view(std::move(one));
  return photographs;
}

Radiance OneView::of_view(Radiance photograph) const {
  if (ghost_) photograph = (*ghost_)(photograph);
  own_.leave_only(view_, photograph);
  return photograph;
}

Registration OneView::part_of(const Registration& whole, const Radiance& lit) const {
  Registration part = whole;
  part.cells = tile_.grid;
  const Point corner{static_cast<double>(tile_.row), static_cast<double>(tile_.col)};
  for (CameraMap& map : part.maps)
    map = map.shifted([corner](Point) { return Point{-corner.row, -corner.col}; });
  part.flood = of_view(lit);
  part.ghost = {};
  return part;
}

/// Of the flood-lit scene. Its noise is in all cells of all photographs.
constexpr int kFloods = 4;
/// For each view, the photographs of all patterns.
Result<std::vector<std::vector<Radiance>>> code_by_view(ViewByView& by_view,
                                                        std::span<const Pattern> patterns,
                                                        const Progress& progress) {
  std::vector<std::vector<Radiance>> photographs(by_view.views());
  const auto count = static_cast<std::int64_t>(patterns.size());
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    if (progress && !progress({"Gray code, view by view", static_cast<std::int64_t>(k), count, kNoneToCome}))
      return Error{ErrorCode::interrupted,
                   fmt::format("calibration stopped at pattern {} of {} of the Gray code", k + 1, count),
                   "run it again"};
    SYMRIG_TRY(auto seen, by_view.measure(patterns[k]));
    for (std::size_t view = 0; view < seen.size(); ++view) photographs[view].push_back(std::move(seen[view]));
  }
  return photographs;
}

/// Each photograph as every pixel's own view alone shows it.
std::vector<Radiance> composed(const OwnViews& own, std::span<const std::vector<Radiance>> by_view) {
  std::vector<Radiance> photographs;
  photographs.reserve(by_view.front().size());
  for (std::size_t k = 0; k < by_view.front().size(); ++k) {
    std::vector<Radiance> of_pattern;
    of_pattern.reserve(by_view.size());
    for (const auto& view : by_view) of_pattern.push_back(view[k]);
    photographs.push_back(own.compose(of_pattern));
  }
  return photographs;
}

}  // namespace

Result<Registration> register_views(Probe& rig, const RegistrationOptions& options) {
  Registration found;
  found.cells = rig.grid();
  const GrayCode code(found.cells);
  ViewByView lit(rig);
  SYMRIG_TRY(auto by_view, code_by_view(lit, gray_code_patterns(found.cells), options.progress));
  const std::vector<Pattern> white(kFloods, Pattern(rig.grid(), 1, 1.F));
  SYMRIG_TRY(const auto floods, photograph_each(rig, white, "flood-lit scene", options.progress));
  found.flood = scaled_sum(floods, 1.F / kFloods);
  SYMRIG_TRY(OwnViews own, OwnViews::find(code, rig.views(), by_view));
  const auto fit = [&]() -> Result<void> {
    SYMRIG_CHECK(fit_maps(composed(own, by_view), found));
    own = OwnViews(found.cells, rig.views(), found.corners(), 0);
    return {};
  };
  // The first map leaves out a strip at the borders of views, and shows which pixels really cross them.
  for (int round = 0; round < 2; ++round) SYMRIG_CHECK(fit());
  const View middle{rig.views().rows / 2, rig.views().cols / 2};
  const std::size_t number = static_cast<std::size_t>(middle.row) * rig.views().cols + middle.col;
  const Radiance of_middle =
      by_view[number][code.white()];  // with its ghost, which is subtracted from by_view
  OneView one(rig, own, middle);
  const Registration part = one.part_of(found, of_middle);
  SYMRIG_CHECK(add_ghost({one, part}, by_view, fit, options.progress, found));
  SYMRIG_CHECK(check_maps(found, options));
  if (is_blurred(found, true)) {
    if (found.ghost.found) {
      SYMRIG_TRY(auto ghost, GhostSubtraction::make(found.corners(), found.ghost.share, found.ghost.place));
      one.subtract(std::move(ghost));
    }
    SYMRIG_TRY(const CombPhotographs combs, photograph_combs(one, options.progress));
    Registration sharp = one.part_of(found, of_middle);
    SYMRIG_CHECK(add_blur(combs, sharp));
    found.blur = sharp.blur;
  }
  return found;
}

}  // namespace symrig::calibration
