// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/views.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

namespace symrig {
namespace {

constexpr int kWindow = 3;          ///< half of the 7 × 7 window that is compared
constexpr int kCoarsestSide = 24;   ///< the pyramid ends before a side gets shorter than this
constexpr int kCoarsestSearch = 6;  ///< a quarter of that side
constexpr int kFinerSearch = 1;     ///< an error of half a pixel becomes one pixel of the next level
constexpr float kLeastCorrelation = 0.3F;
constexpr int kLeastSamples = (2 * kWindow + 1) * (2 * kWindow + 1) / 2;

/// Half the size: the mean of the valid ones of four pixels, NaN if none is.
Image<float> halved(const Image<float>& picture) {
  const Grid fine = picture.grid();
  Image<float> coarse(Grid{(fine.rows + 1) / 2, (fine.cols + 1) / 2});
  for (int row = 0; row < coarse.grid().rows; ++row)
    for (int col = 0; col < coarse.grid().cols; ++col) {
      float sum = 0, count = 0;
      for (int r = 2 * row; r < std::min(2 * row + 2, fine.rows); ++r)
        for (int c = 2 * col; c < std::min(2 * col + 2, fine.cols); ++c)
          if (!std::isnan(picture.at(r, c))) {
            sum += picture.at(r, c);
            ++count;
          }
      coarse.at(row, col) = count > 0 ? sum / count : std::numeric_limits<float>::quiet_NaN();
    }
  return coarse;
}

/// Where each pixel of one picture is found in another: row shift (channel 0) and column shift (channel 1).
/// With the correlation there, 0 where none was found.
struct Shifts {
  Image<float> by;
  Image<float> correlation;
};

/// Two pictures to be matched at one size.
struct Pair {
  const Image<float>& from;
  const Image<float>& to;
};

struct Place {
  int row, col;
};

/// Normalised correlation of the windows around two pixels, over what both have. 1 for windows that are equal
/// up to brightness and contrast, 0 where there is too little to compare.
float correlation(const Pair& pair, Place a, Place b) {
  const Grid ga = pair.from.grid(), gb = pair.to.grid();
  const int top = std::max({-kWindow, -a.row, -b.row});
  const int bottom = std::min({kWindow, ga.rows - 1 - a.row, gb.rows - 1 - b.row});
  const int left = std::max({-kWindow, -a.col, -b.col});
  const int right = std::min({kWindow, ga.cols - 1 - a.col, gb.cols - 1 - b.col});
  double n = 0, sx = 0, sy = 0, sxx = 0, syy = 0, sxy = 0;
  for (int dr = top; dr <= bottom; ++dr)
    for (int dc = left; dc <= right; ++dc) {
      const auto x = static_cast<double>(pair.from.at(a.row + dr, a.col + dc));
      const auto y = static_cast<double>(pair.to.at(b.row + dr, b.col + dc));
      if (std::isnan(x) || std::isnan(y)) continue;
      ++n;
      sx += x;
      sy += y;
      sxx += x * x;
      syy += y * y;
      sxy += x * y;
    }
  const double vx = n * sxx - sx * sx;
  const double vy = n * syy - sy * sy;
  // Below a rounding error of the sums there is no texture.
  if (n < kLeastSamples || vx <= 1e-12 * n * sxx || vy <= 1e-12 * n * syy) return 0;
  return static_cast<float>((n * sxy - sx * sy) / std::sqrt(vx * vy));
}

float at_shift(const Pair& pair, Place at, Place shift) {
  const Place seen{at.row + shift.row, at.col + shift.col};
  const Grid to = pair.to.grid();
  if (seen.row < 0 || seen.col < 0 || seen.row >= to.rows || seen.col >= to.cols) return -1;
  return correlation(pair, at, seen);
}

/// Where the parabola through three correlations peaks, from the middle one: [−½, ½].
float peak(float before, float middle, float after) {
  const float curvature = before - 2 * middle + after;
  return curvature < 0 ? std::clamp((before - after) / (2 * curvature), -0.5F, 0.5F) : 0.0F;
}

/// The best shift of one pixel within `reach` of a guess.
void search(const Pair& pair, Place at, int reach, bool refine, Shifts& shifts) {
  const Place guess{static_cast<int>(std::lround(shifts.by.at(at.row, at.col, 0))),
                    static_cast<int>(std::lround(shifts.by.at(at.row, at.col, 1)))};
  Place best = guess;
  float most = -2;
  for (int dr = -reach; dr <= reach; ++dr)
    for (int dc = -reach; dc <= reach; ++dc) {
      const Place shift{guess.row + dr, guess.col + dc};
      const float found = at_shift(pair, at, shift);
      if (found > most) {
        most = found;
        best = shift;
      }
    }
  auto row = static_cast<float>(best.row), col = static_cast<float>(best.col);
  if (refine && most > 0) {
    row += peak(at_shift(pair, at, {best.row - 1, best.col}), most,
                at_shift(pair, at, {best.row + 1, best.col}));
    col += peak(at_shift(pair, at, {best.row, best.col - 1}), most,
                at_shift(pair, at, {best.row, best.col + 1}));
  }
  shifts.by.at(at.row, at.col, 0) = row;
  shifts.by.at(at.row, at.col, 1) = col;
  shifts.correlation.at(at.row, at.col) = std::max(most, 0.0F);
}

void search_everywhere(const Pair& pair, int reach, bool refine, Shifts& shifts) {
  tbb::parallel_for(0, pair.from.grid().rows, [&](int row) {
    for (int col = 0; col < pair.from.grid().cols; ++col) search(pair, {row, col}, reach, refine, shifts);
  });
}

/// 3 × 3 median of each channel: one wrong pixel must not send the finer levels astray.
Image<float> median_filtered(const Image<float>& picture) {
  const Grid grid = picture.grid();
  Image<float> out(grid, picture.channels());
  for (int channel = 0; channel < picture.channels(); ++channel)
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col) {
        std::array<float, 9> around{};
        std::size_t n = 0;
        for (int r = std::max(row - 1, 0); r <= std::min(row + 1, grid.rows - 1); ++r)
          for (int c = std::max(col - 1, 0); c <= std::min(col + 1, grid.cols - 1); ++c)
            around[n++] = picture.at(r, c, channel);
        out.at(row, col, channel) = median(std::span(around).first(n));
      }
  return out;
}

/// The shifts of a level as guesses for the next finer one.
Image<float> doubled(const Image<float>& coarse, Grid fine) {
  Image<float> out(fine, coarse.channels());
  for (int channel = 0; channel < coarse.channels(); ++channel)
    for (int row = 0; row < fine.rows; ++row)
      for (int col = 0; col < fine.cols; ++col)
        out.at(row, col, channel) = 2 * coarse.at(row / 2, col / 2, channel);
  return out;
}

/// One level of the pyramid that fill_by_trust goes down and up: weighted sums of four pixels.
struct Trusted {
  Image<float> by, trust;
};

Trusted pooled(const Trusted& fine) {
  const Grid grid = fine.by.grid();
  const Grid half{(grid.rows + 1) / 2, (grid.cols + 1) / 2};
  Trusted coarse{Image<float>(half, fine.by.channels()), Image<float>(half)};
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const float trust = fine.trust.at(row, col);
      coarse.trust.at(row / 2, col / 2) += trust;
      for (int channel = 0; channel < fine.by.channels(); ++channel)
        coarse.by.at(row / 2, col / 2, channel) += trust * fine.by.at(row, col, channel);
    }
  for (int row = 0; row < half.rows; ++row)
    for (int col = 0; col < half.cols; ++col) {
      float& trust = coarse.trust.at(row, col);
      for (int channel = 0; channel < fine.by.channels(); ++channel)
        if (trust > 0) coarse.by.at(row, col, channel) /= trust;
      trust = std::min(trust, 1.0F);
    }
  return coarse;
}

/// The value between the centres of a coarse picture's pixels at the centre of fine pixel (row, col).
float between(const Image<float>& coarse, int row, int col, int channel) {
  const auto split = [](int at, int n) {
    const float place = std::clamp(0.5F * static_cast<float>(at) - 0.25F, 0.0F, static_cast<float>(n - 1));
    const int low = static_cast<int>(place);
    return std::pair{low, place - static_cast<float>(low)};
  };
  const auto [r, v] = split(row, coarse.grid().rows);
  const auto [c, u] = split(col, coarse.grid().cols);
  const int r1 = std::min(r + 1, coarse.grid().rows - 1), c1 = std::min(c + 1, coarse.grid().cols - 1);
  return (1 - v) * ((1 - u) * coarse.at(r, c, channel) + u * coarse.at(r, c1, channel)) +
         v * ((1 - u) * coarse.at(r1, c, channel) + u * coarse.at(r1, c1, channel));
}

void fill(Trusted& level) {
  const Grid grid = level.by.grid();
  if (grid.size() == 1) return;
  Trusted coarse = pooled(level);
  fill(coarse);
  for (int channel = 0; channel < level.by.channels(); ++channel)
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col) {
        const float trust = level.trust.at(row, col);
        float& value = level.by.at(row, col, channel);
        value = trust * value + (1 - trust) * between(coarse.by, row, col, channel);
      }
}

/// Fills shifts where trust is low from where it is high, near before far, and leaves them where it is 1.
/// shapes: by [grid, any channels], trust [grid, 1], in [0, 1].
void fill_by_trust(Image<float>& by, const Image<float>& trust) {
  Trusted level{std::move(by), trust};
  fill(level);
  by = std::move(level.by);
}

Shifts match_level(const Pair& pair) {
  const Grid grid = pair.from.grid();
  Shifts shifts{Image<float>(grid, 2), Image<float>(grid)};
  const bool coarsest = std::min(grid.rows, grid.cols) < 2 * kCoarsestSide;
  if (!coarsest) {
    const Image<float> from = halved(pair.from), to = halved(pair.to);
    shifts.by = doubled(match_level({from, to}).by, grid);
  }
  search_everywhere(pair, coarsest ? kCoarsestSearch : kFinerSearch, false, shifts);
  Image<float> trust(grid);
  for (std::size_t k = 0; k < trust.values().size(); ++k)
    trust.values()[k] = shifts.correlation.values()[k] > kLeastCorrelation ? 1.0F : 0.0F;
  fill_by_trust(shifts.by, trust);
  shifts.by = median_filtered(shifts.by);
  return shifts;
}

/// Dense block matching of `from` in `to`, coarse to fine. A pixel that is NaN is left out of all windows.
/// shapes: one channel each; sizes may differ by a pixel or so.
Shifts match(const Image<float>& from, const Image<float>& to) {
  Shifts shifts = match_level({from, to});
  search_everywhere({from, to}, kFinerSearch, true, shifts);
  return shifts;
}

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
  Shifts there = match(view, reference);
  const Shifts back = match(reference, view);
  for (int row = 0; row < view.grid().rows; ++row)
    for (int col = 0; col < view.grid().cols; ++col)
      there.correlation.at(row, col) *= returns(there, back, row, col);
  fill_by_trust(there.by, there.correlation);
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
