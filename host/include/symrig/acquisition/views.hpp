// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <optional>

namespace symrig {

/// What several coaxial views see of one another.
struct MatchedViews {
  /// As Split::surface, in the frame of the reference view. [grid], 2 channels.
  Image<float> surface;
  /// How well each pixel was found in the reference view: its correlation there, 0 where the match back does
  /// not return. In the reference view itself 1 on valid pixels. [grid], values in [0, 1].
  Image<float> confidence;
  View reference;
};

/// Finds, for every pixel of every view, the place in the middle view that shows the same point of the scene.
/// It reads one flood-lit photograph. Method: block matching by normalised correlation, coarse to fine,
/// checked by matching back, refined to a fraction of a pixel. What has no match takes the shift of its
/// surroundings. shapes: flood any channels (their mean is matched).  error: about a quarter of a pixel where
/// the scene has texture. Without texture, or with views that share nothing, the confidence is low.  Views
/// may differ in brightness and in any shift up to about a quarter of a tile. Turned or mirrored views are
/// not found. fails: bad_argument (views that do not fit), size_mismatch (mean and valid differ).
Result<MatchedViews> match_views(const Radiance& flood, ViewLayout views);

/// What the flood-lit photograph shows about the views.
struct ViewsFound {
  double confidence = 0;  ///< median confidence of the pixels outside the reference view
  /// How far the shift between the two outermost views varies over the scene: 5th to 95th percentile of the
  /// shifts to the reference view, scaled to a whole row or column of evenly spaced views. units: pixels
  double parallax = 0;
};
ViewsFound judge_views(const MatchedViews& matched, ViewLayout views);

/// How to cut a grid of views, from one flood-lit photograph. With an order wanted, that one (and the surface
/// that compensated needs). Without: flat for a single view, and where most pixels have no match in another
/// view. Views last where parallax stays below two pixels, the smallest block. Else compensated.
/// source: measured, docs/howto-views.md.  fails: as match_views.
Result<Split> choose_split(const Radiance& flood, ViewLayout views,
                           std::optional<SplitOrder> wanted = std::nullopt);

}  // namespace symrig
