// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_optics/ghost_fit.hpp"
#include "calibration/photograph_each.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/camera_optics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// Residuals count up to this many robust sigmas: light from a mirror is as bright as direct light.
constexpr double kClamp = 3;

/// What the patterns let each cell see, all channels added up.
class GhostSearch {
 public:
  GhostSearch(std::span<const Pattern> patterns, std::span<const Radiance> photographs);
  GhostCandidate best() const;

 private:
  /// Sums of a regression of `beyond` on `light`, both less their means over the dark photographs of a cell.
  struct Sums {
    double products = 0, squares = 0;
    Sums operator+(const Sums& other) const { return {products + other.products, squares + other.squares}; }
  };
  std::size_t index(int row, int col) const {
    return static_cast<std::size_t>(std::int64_t{row} * grid_.cols + col) * count_;
  }
  void center(std::span<float> beyond) const;
  void clamp(std::span<const Pattern> patterns);
  Sums sums(int down, int right) const;
  Grid reach() const {
    return {std::min(CameraGhost::farthest, grid_.rows / 3), std::min(CameraGhost::farthest, grid_.cols / 3)};
  }

  Grid grid_;
  std::size_t count_;
  // Of each cell, the photographs one after the other.
  std::vector<float> light_;   // 0 where it is not valid
  std::vector<float> dark_;    // 1: the cell is dark, and another photograph of it too
  std::vector<float> beyond_;  // of dark cells: the light less its mean over the dark photographs
};

GhostSearch::GhostSearch(std::span<const Pattern> patterns, std::span<const Radiance> photographs)
    : grid_(patterns.front().grid()), count_(patterns.size()) {
  const auto cells = static_cast<std::size_t>(grid_.size());
  light_.assign(cells * count_, 0), dark_ = light_;
  const auto dark = dark_cells(patterns);
  for (std::size_t i = 0; i < cells; ++i) {
    float photographs_of_cell = 0;
    for (std::size_t k = 0; k < count_; ++k) {
      bool valid = true;
      float sum = 0;
      for (int c = 0; c < photographs[k].mean.channels(); ++c) {
        valid = valid && photographs[k].valid.plane(c)[i] != 0;
        sum += photographs[k].mean.plane(c)[i];
      }
      if (!valid) continue;
      light_[i * count_ + k] = sum;
      dark_[i * count_ + k] = dark[k].values()[i] ? 1.F : 0.F;
      photographs_of_cell += dark_[i * count_ + k];
    }
    if (photographs_of_cell < 2)
      std::fill_n(dark_.begin() + static_cast<std::ptrdiff_t>(i * count_), count_, 0.F);
  }
  beyond_ = light_;
  center(beyond_);
  clamp(patterns);
}

void GhostSearch::center(std::span<float> beyond) const {
  for (std::size_t i = 0; i < beyond.size(); i += count_) {
    float sum = 0, dark = 0;
    for (std::size_t k = i; k < i + count_; ++k) sum += dark_[k] * beyond[k], dark += dark_[k];
    for (std::size_t k = i; k < i + count_; ++k)
      beyond[k] = dark > 0 ? dark_[k] * (beyond[k] - sum / dark) : 0;
  }
}

/// Light that is much stronger than in most cells tells of the scene. But the ghosts of interest must not be
/// clamped where nothing else is seen.
void GhostSearch::clamp(std::span<const Pattern> patterns) {
  std::vector<double> sizes, lit;
  for (std::size_t k = 0; k < beyond_.size(); ++k) {
    if (dark_[k] != 0) sizes.push_back(static_cast<double>(std::abs(beyond_[k])));
    if (patterns[k % count_].values()[k / count_] > 0) lit.push_back(static_cast<double>(light_[k]));
  }
  const auto most = static_cast<float>(
      std::max(kClamp * robust_sigma(sizes, 0), CameraGhost::smallest_share * median(lit)));
  for (float& v : beyond_) v = std::clamp(v, -most, most);
  center(beyond_);
}

GhostSearch::Sums GhostSearch::sums(int down, int right) const {
  double products = 0, squares = 0;
  for (int row = std::max(0, -down); row < grid_.rows - std::max(0, down); ++row)
    for (int col = std::max(0, -right); col < grid_.cols - std::max(0, right); ++col) {
      const std::size_t here = index(row, col), there = index(row + down, col + right);
      float sum = 0, square = 0, product = 0, dark = 0;
      for (std::size_t k = 0; k < count_; ++k) {
        const float v = light_[there + k], d = dark_[here + k];
        sum += d * v, square += d * v * v, product += beyond_[here + k] * v, dark += d;
      }
      if (dark == 0) continue;
      products += static_cast<double>(product), squares += static_cast<double>(square - sum * sum / dark);
    }
  return {products, squares};
}

/// Boxes of 2 × 2 places: a ghost at a fraction of a cell is seen at all of them, and the dots are as large.
GhostCandidate GhostSearch::best() const {
  const Grid far = reach();
  const auto index_of = [&](int down, int right) {
    return static_cast<std::size_t>(down + far.rows) * static_cast<std::size_t>(2 * far.cols + 1) +
           static_cast<std::size_t>(right + far.cols);
  };
  std::vector<Sums> all(index_of(far.rows, far.cols) + 1);
  tbb::parallel_for(-far.rows, far.rows + 1, [&](int down) {
    for (int right = -far.cols; right <= far.cols; ++right) all[index_of(down, right)] = sums(down, right);
  });
  const auto share = [&](int down, int right) {
    const auto at = [&](int a, int b) { return all[index_of(down + a, right + b)]; };
    const Sums box = at(0, 0) + at(0, 1) + at(1, 0) + at(1, 1);
    return box.squares > 0 ? box.products / box.squares : 0;
  };
  std::vector<double> differences;
  GhostCandidate best;
  for (int down = -far.rows; down < far.rows; ++down)
    for (int right = -far.cols; right < far.cols; ++right) {
      const Point place{down + 0.5, right + 0.5};
      if (std::max(std::abs(place.row), std::abs(place.col)) < CameraGhost::nearest) continue;
      const double difference = share(down, right) - share(-down - 1, -right - 1);
      differences.push_back(difference);
      if (difference > best.share) best.share = difference, best.place = place;
    }
  best.sigma = robust_sigma(differences, 0);
  return best;
}

}  // namespace

std::vector<Image<std::uint8_t>> dark_cells(std::span<const Pattern> patterns) {
  std::vector<Image<std::uint8_t>> dark;
  for (const Pattern& pattern : patterns) {
    const Grid grid = pattern.grid();
    Image<std::uint8_t>& out = dark.emplace_back(grid, 1, std::uint8_t{1});
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col) {
        if (!(pattern.at(row, col) > 0)) continue;
        for (int r = std::max(row - 1, 0); r <= std::min(row + 1, grid.rows - 1); ++r)
          for (int c = std::max(col - 1, 0); c <= std::min(col + 1, grid.cols - 1); ++c) out.at(r, c) = 0;
      }
  }
  return dark;
}

GhostCandidate find_ghost(std::span<const Pattern> patterns, std::span<const Radiance> photographs) {
  return GhostSearch(patterns, photographs).best();
}

}  // namespace symrig::calibration

namespace symrig {

using calibration::GhostCandidate;

namespace {

constexpr int kPatterns = 6, kDot = 2, kDotTile = 6;
/// Light that the scene exchanges goes both ways, to the gain ratio of the optics. So of a one-sided light,
/// less than this share comes back.
constexpr double kMostOpposite = 0.5;
/// Relative error of a share, because light between pixels is interpolated. Measured on a plane: 0.017.
constexpr double kBetweenPixels = 0.02;

bool is_ghost(const CameraGhost& ghost, double opposite) {
  const double away = std::max(std::abs(ghost.place.row), std::abs(ghost.place.col));
  return ghost.significance > CameraGhost::sigmas && ghost.share > CameraGhost::smallest_share &&
         ghost.share <= CameraGhost::largest_share && away >= CameraGhost::nearest &&
         std::abs(opposite) < kMostOpposite * ghost.share;
}

Result<GhostCandidate> candidate_of(std::span<const Pattern> patterns, std::span<const Radiance> photographs,
                                    const CellWeights& by_area) {
  std::vector<Radiance> on_cells;
  for (const Radiance& one : photographs) {
    SYMRIG_TRY(Radiance seen, by_area.gather(one));
    on_cells.push_back(std::move(seen));
  }
  return calibration::find_ghost(patterns, on_cells);
}

/// A ghost puts light at other places too, because dots are random. So it is judged by the candidates that
/// are left without it.
Result<CameraGhost> judge(std::span<const Pattern> patterns, std::vector<Radiance> photographs,
                          std::span<const CornerMap> corners, const CellWeights& by_area) {
  SYMRIG_TRY(const GhostCandidate candidate, candidate_of(patterns, photographs, by_area));
  const auto significance = [&](double sigma) { return sigma > 0 ? candidate.share / sigma : 0; };
  CameraGhost none;
  none.significance = significance(candidate.sigma);
  const auto found = calibration::fit_ghost(patterns, photographs, corners, candidate.place);
  // Light that the scene exchanges is seen at both places.
  CameraGhost ghost;
  ghost.share = found.share - found.opposite;
  ghost.place = found.place;
  if (!(ghost.share > CameraGhost::smallest_share && ghost.share <= CameraGhost::largest_share)) return none;
  for (Radiance& one : photographs) {
    SYMRIG_TRY(one, without_ghost(one, corners, ghost));
  }
  SYMRIG_TRY(const GhostCandidate left, candidate_of(patterns, photographs, by_area));
  ghost.significance = significance(left.sigma);
  if (!is_ghost(ghost, found.opposite)) return none;
  ghost.sigma = ghost.share * std::hypot(1 / ghost.significance, kBetweenPixels);
  ghost.found = true;
  return ghost;
}

}  // namespace

std::vector<Pattern> ghost_patterns(Grid cells) {
  std::vector<Pattern> patterns;
  Random random(1);
  for (int k = 0; k < kPatterns; ++k) {
    Pattern& pattern = patterns.emplace_back(cells, 1);
    for (int top = 0; top < cells.rows; top += kDotTile)
      for (int left = 0; left < cells.cols; left += kDotTile) {
        const auto offset = [&] { return static_cast<int>(random.bits() % (kDotTile - kDot + 1)); };
        const int row = top + offset(), col = left + offset();
        for (int r = row; r < std::min(row + kDot, cells.rows); ++r)
          for (int c = col; c < std::min(col + kDot, cells.cols); ++c) pattern.at(r, c) = 1;
      }
  }
  return patterns;
}

Result<CameraGhost> measure_ghost(Probe& rig, const CellWeights& by_area, std::span<const CornerMap> corners,
                                  const Progress& progress) {
  const Grid cells = rig.grid(), camera = rig.camera_grid();
  const bool fit = std::ranges::all_of(corners, [&](const CornerMap& map) {
    return map.grid() == Grid{camera.rows + 1, camera.cols + 1} && map.channels() == 2;
  });
  if (!fit || by_area.cells() != cells || by_area.camera() != camera ||
      (corners.size() != 1 && std::cmp_not_equal(corners.size(), rig.channels())))
    return Error{ErrorCode::size_mismatch, "the maps and weights for ghosts do not fit the rig",
                 "calibrate the rig again"};
  if (std::min(cells.rows, cells.cols) < 2 * kDotTile) return CameraGhost{};
  const std::vector<Pattern> patterns = ghost_patterns(cells);
  SYMRIG_TRY(auto photographs, calibration::photograph_each(rig, patterns, "ghost", progress));
  return judge(patterns, std::move(photographs), corners, by_area);
}

}  // namespace symrig
