// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/outline.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace symrig::calibration {

/// Which of several views each camera pixel belongs to: it looks at cells of that view's tile. Light from
/// that tile comes back to it along its own path. All other light that it gets is indirect, or comes from
/// another view.
class OwnViews {
 public:
  /// From Gray codes that were shown in one view after another.
  ///
  /// A pixel that is lit from V views decodes V cells, and one of them is its own. Camera and projector share
  /// an axis, so the map of own cells is smooth over the whole picture, whatever the scene is. The cells of
  /// other views form no such map, or one that ends a tile earlier. So the affine map that most pixels agree
  /// with is searched by samples of three pixels [Fischler81], and refined with perspective and distortion.
  /// by_view: for each view, the photographs of all patterns of `code`.
  /// fails: bad_value (too few pixels agree on one map).
  static Result<OwnViews> find(const GrayCode& code, ViewLayout views,
                               std::span<const std::vector<Radiance>> by_view);
  /// From the maps of the channels. margin: pixels that look closer than this to the border of two views
  /// belong to none [cells].
  OwnViews(Grid cells, ViewLayout views, std::span<const CornerMap> maps, double margin);

  /// Each pixel as its own view alone shows it. A pixel that belongs to none is invalid.
  Radiance compose(std::span<const Radiance> by_view) const;
  /// Makes the pixels that do not belong to this view invalid.
  void leave_only(View view, Radiance& photograph) const;

 private:
  ViewLayout views_;
  Image<std::uint16_t> own_;  // 1 + the number of the view, or 0: none; on the camera's grid
};

/// The pattern inside the tile of one view; dark elsewhere.
Pattern inside_view(const Pattern& pattern, ViewLayout views, std::size_t view);

/// Photographs of patterns that are lit from one view after another.
///
/// All views of a rig see the same scene. So a point is lit from all of them, and what a camera pixel gets
/// does not tell which projector pixel it faces. Light from one view alone does.
///
/// Light adds up, so few photographs are taken: what is dark inside a view is dark, a view that is lit whole
/// is photographed once, and the complement of the pattern before is that photograph less the pattern's.
/// The errors of a pattern and its complement then have a part in common.
class ViewByView {
 public:
  /// rig must outlive this.
  explicit ViewByView(Probe& rig);

  std::size_t views() const { return seen_.size(); }
  /// Result: the photograph of the pattern by each view alone.
  /// fails: as the rig.
  Result<std::vector<Radiance>> measure(const Pattern& pattern);

 private:
  struct Photographed {
    Pattern pattern;
    Radiance photograph;
  };
  /// What was seen of one view.
  struct SeenView {
    std::optional<Radiance> whole;
    std::optional<Photographed> last;
  };
  Result<Radiance> photograph(const Pattern& pattern);
  Result<const Radiance*> whole_of(std::size_t view);
  Result<Radiance> measure_view(const Pattern& pattern, std::size_t view);

  Probe& rig_;
  std::vector<SeenView> seen_;
};

}  // namespace symrig::calibration
