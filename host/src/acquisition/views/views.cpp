// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/views.hpp"

#include "acquisition/views/views_match.hpp"
#include "symrig/base/quantile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace symrig {
namespace {

using acquisition::Shifts;

/// A match that comes back farther away than this is wrong: half a pixel of error each way.
constexpr float kReturn = 1.0F;
/// Half of the pixels must match better than this for the views to count as views of one scene.
constexpr double kConfident = 0.5;
/// Side of the smallest block that is more than a pixel. Parallax below it parts no cluster before the last
/// level.
constexpr double kSmallestBlock = 2;

/// One view of the photograph, the mean of its channels; NaN where a channel is invalid.
Image<float> view_picture(const Radiance& flood, const Tile& tile) {
  Image<float> picture(tile.grid);
  const int channels = flood.mean.channels();
  for (int row = 0; row < tile.grid.rows; ++row)
    for (int col = 0; col < tile.grid.cols; ++col) {
      float sum = 0;
      for (int channel = 0; channel < channels; ++channel)
        sum += flood.valid.at(tile.row + row, tile.col + col, channel) != 0
                   ? flood.mean.at(tile.row + row, tile.col + col, channel)
                   : std::numeric_limits<float>::quiet_NaN();
      picture.at(row, col) = sum / static_cast<float>(channels);
    }
  return picture;
}

/// 1 where the match back from the place found returns to where it started, 0 elsewhere.
float returns(const Shifts& there, const Shifts& back, int row, int col) {
  const float dr = there.by.at(row, col, 0), dc = there.by.at(row, col, 1);
  const Grid grid = back.by.grid();
  const int r = row + static_cast<int>(std::lround(dr)), c = col + static_cast<int>(std::lround(dc));
  if (r < 0 || c < 0 || r >= grid.rows || c >= grid.cols) return 0;
  return std::hypot(dr + back.by.at(r, c, 0), dc + back.by.at(r, c, 1)) <= kReturn ? 1.0F : 0.0F;
}

/// The shifts of one view to the reference, complete, with the trust in each.
Shifts checked(const Image<float>& view, const Image<float>& reference) {
  Shifts there = acquisition::match(view, reference);
  const Shifts back = acquisition::match(reference, view);
  for (int row = 0; row < view.grid().rows; ++row)
    for (int col = 0; col < view.grid().cols; ++col)
      there.correlation.at(row, col) *= returns(there, back, row, col);
  acquisition::fill_by_trust(there.by, there.correlation);
  return there;
}

void place_reference(const Radiance& flood, const Tile& tile, MatchedViews& into) {
  const Image<float> picture = view_picture(flood, tile);
  for (int row = 0; row < tile.grid.rows; ++row)
    for (int col = 0; col < tile.grid.cols; ++col) {
      into.surface.at(tile.row + row, tile.col + col, 0) = static_cast<float>(row) + 0.5F;
      into.surface.at(tile.row + row, tile.col + col, 1) = static_cast<float>(col) + 0.5F;
      into.confidence.at(tile.row + row, tile.col + col) = std::isnan(picture.at(row, col)) ? 0.0F : 1.0F;
    }
}

void place_view(const Shifts& shifts, const Tile& tile, MatchedViews& into) {
  for (int row = 0; row < tile.grid.rows; ++row)
    for (int col = 0; col < tile.grid.cols; ++col) {
      into.surface.at(tile.row + row, tile.col + col, 0) =
          static_cast<float>(row) + 0.5F + shifts.by.at(row, col, 0);
      into.surface.at(tile.row + row, tile.col + col, 1) =
          static_cast<float>(col) + 0.5F + shifts.by.at(row, col, 1);
      into.confidence.at(tile.row + row, tile.col + col) = shifts.correlation.at(row, col);
    }
}

template <class Use>
void for_each_view(ViewLayout views, const Use& use) {
  for (int row = 0; row < views.rows; ++row)
    for (int col = 0; col < views.cols; ++col) use(View{row, col});
}

/// 5th to 95th percentile of the shift of one view along one axis. The 5 % at either end are where matches
/// go wrong first, at edges and behind them.
double spread(const MatchedViews& matched, const Tile& tile, int axis) {
  std::vector<float> shifts;
  for (int row = 0; row < tile.grid.rows; ++row)
    for (int col = 0; col < tile.grid.cols; ++col)
      shifts.push_back(matched.surface.at(tile.row + row, tile.col + col, axis) -
                       static_cast<float>(axis == 0 ? row : col));
  const auto low = static_cast<double>(quantile(shifts, 0.05));
  return static_cast<double>(quantile(shifts, 0.95)) - low;
}

/// What the shift over `steps` views is to be multiplied by for the shift over all of them.
double reach(int views, int steps) {
  return steps == 0 ? 0 : static_cast<double>(views - 1) / std::abs(steps);
}

}  // namespace

Result<MatchedViews> match_views(const Radiance& flood, ViewLayout views) {
  const Grid grid = flood.mean.grid();
  if (!grid.valid() || !views.fits(grid))
    return Error{ErrorCode::bad_argument,
                 "views " + to_string(views) + " do not tile a photograph of " + to_string(grid),
                 "give the rows x columns of views that the picture shows"};
  if (flood.valid.grid() != grid || flood.valid.channels() != flood.mean.channels())
    return Error{ErrorCode::size_mismatch, "the photograph and its mask of valid pixels differ in size",
                 "give both of one photograph"};
  MatchedViews matched{Image<float>(grid, 2), Image<float>(grid), {views.rows / 2, views.cols / 2}};
  const Tile middle = views.tile(grid, matched.reference);
  const Image<float> reference = view_picture(flood, middle);
  for_each_view(views, [&](View view) {
    const Tile tile = views.tile(grid, view);
    if (view == matched.reference)
      place_reference(flood, tile, matched);
    else
      place_view(checked(view_picture(flood, tile), reference), tile, matched);
  });
  return matched;
}

ViewsFound judge_views(const MatchedViews& matched, ViewLayout views) {
  ViewsFound found;
  std::vector<float> confidence;
  for_each_view(views, [&](View view) {
    const Tile tile = views.tile(matched.surface.grid(), view);
    if (view == matched.reference) return;
    found.parallax = std::max(
        {found.parallax, spread(matched, tile, 0) * reach(views.rows, view.row - matched.reference.row),
         spread(matched, tile, 1) * reach(views.cols, view.col - matched.reference.col)});
    for (int row = 0; row < tile.grid.rows; ++row)
      for (int col = 0; col < tile.grid.cols; ++col)
        confidence.push_back(matched.confidence.at(tile.row + row, tile.col + col));
  });
  found.confidence = static_cast<double>(quantile(confidence, 0.5));
  return found;
}

Result<Split> choose_split(const Radiance& flood, ViewLayout views, std::optional<SplitOrder> wanted) {
  const SplitOrder order = wanted.value_or(SplitOrder::compensated);
  if (order != SplitOrder::compensated || views.single())
    return Split{views, wanted.value_or(SplitOrder::flat), {}};
  SYMRIG_TRY(MatchedViews matched, match_views(flood, views));
  const ViewsFound found = judge_views(matched, views);
  Split compensated{views, order, std::move(matched.surface)};
  if (wanted) return compensated;
  if (found.confidence < kConfident) return Split{views, SplitOrder::flat, {}};
  if (found.parallax < kSmallestBlock) return Split{views, SplitOrder::views_last, {}};
  return compensated;
}

}  // namespace symrig
