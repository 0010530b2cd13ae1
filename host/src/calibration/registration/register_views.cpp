// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/register_views.hpp"

#include "calibration/registration/add_blur.hpp"
#include "calibration/registration/add_ghost.hpp"
#include "calibration/registration/fitted_maps.hpp"
#include "calibration/registration/one_view.hpp"
#include "calibration/registration/own_views.hpp"
#include "calibration/registration/photograph_each.hpp"
#include "calibration/registration/scaled_sum.hpp"
#include "calibration/registration/view_by_view.hpp"

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

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
