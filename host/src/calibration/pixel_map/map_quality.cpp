// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/pixel_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Dense>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig {
namespace {

/// One neighbour, relative to the pixel that is judged.
struct Neighbour {
  double dcol, drow, x, y;
  double distance = 0;  ///< of its position from the fit
};

/// A position; 0 for the axis that a map does not know.
double position_or_zero(float position) {
  return std::isnan(position) ? 0 : static_cast<double>(position);
}

double length(double x, double y) {
  return std::sqrt(x * x + y * y);  // positions have similar size, so overflow is impossible
}

/// Position at the centre, and the slopes, of both axes.
using Affine = Eigen::Matrix<double, 3, 2>;

std::optional<Affine> weighted_fit(const std::vector<Neighbour>& all, const std::vector<double>& weight) {
  double n = 0, c = 0, r = 0, cc = 0, cr = 0, rr = 0, x = 0, xc = 0, xr = 0, y = 0, yc = 0, yr = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Neighbour& q = all[i];
    const double w = weight[i], wc = w * q.dcol, wr = w * q.drow;
    n += w, c += wc, r += wr, cc += wc * q.dcol, cr += wc * q.drow, rr += wr * q.drow;
    x += w * q.x, xc += wc * q.x, xr += wr * q.x, y += w * q.y, yc += wc * q.y, yr += wr * q.y;
  }
  const Eigen::Matrix3d a{{n, c, r}, {c, cc, cr}, {r, cr, rr}};
  const Affine b{{x, y}, {xc, yc}, {xr, yr}};
  const Eigen::LDLT<Eigen::Matrix3d> factor(a);
  if (!(factor.vectorD().minCoeff() > 1e-6 * factor.vectorD().maxCoeff())) return std::nullopt;
  return factor.solve(b);
}

double median_distance(const std::vector<Neighbour>& all, std::vector<double>& scratch) {
  scratch.clear();
  for (const Neighbour& q : all) scratch.push_back(q.distance);
  return median(scratch);
}

/// Sets q.distance of all from a fit.
void measure(std::vector<Neighbour>& all, const Affine& f) {
  for (Neighbour& q : all)
    q.distance = length(f(0, 0) + f(1, 0) * q.dcol + f(2, 0) * q.drow - q.x,
                        f(0, 1) + f(1, 1) * q.dcol + f(2, 1) * q.drow - q.y);
}

/// Robust fit to the neighbours; nullopt if they lie on a line. Where two surfaces meet, plain least squares
/// gives a map between them. Then the fit also starts from each half of the window, and the one with the
/// least median distance is used.
class RobustFit {
 public:
  explicit RobustFit(double outlier) : outlier_(outlier) {}

  std::optional<Affine> operator()(std::vector<Neighbour>& all) {
    auto best = begin_with(all, [](const Neighbour&) { return true; });
    if (!best || best->apart <= 0.1 * static_cast<double>(all.size())) return fit_of(best);
    for (const int side : {-1, 1}) {
      better(best, begin_with(all, [&](const Neighbour& q) { return side * q.dcol >= 0; }));
      better(best, begin_with(all, [&](const Neighbour& q) { return side * q.drow >= 0; }));
    }
    return fit_of(best);
  }

 private:
  static constexpr int kPasses = 6, kAbsolutePasses = 3;
  struct Candidate {
    Affine fit;
    double apart = 0;   ///< neighbours further away than half an outlier
    double median = 0;  ///< distance of the median neighbour
  };

  static std::optional<Affine> fit_of(const std::optional<Candidate>& candidate) {
    return candidate ? std::optional(candidate->fit) : std::nullopt;
  }
  static void better(std::optional<Candidate>& best, const std::optional<Candidate>& other) {
    if (other && other->median < best->median) best = other;
  }

  template <class Use>
  std::optional<Candidate> begin_with(std::vector<Neighbour>& all, Use use) {
    weight_.clear();
    for (const Neighbour& q : all) weight_.push_back(use(q) ? 1 : 0);
    std::optional<Affine> fit;
    for (int pass = 0; pass < kPasses; ++pass) {
      fit = weighted_fit(all, weight_);
      if (!fit) return std::nullopt;
      measure(all, *fit);
      reweight(all, pass);
    }
    const auto apart =
        std::ranges::count_if(all, [&](const Neighbour& q) { return q.distance > outlier_ / 2; });
    return Candidate{*fit, static_cast<double>(apart), median_distance(all, scratch_)};
  }

  void reweight(const std::vector<Neighbour>& all, int pass) {
    if (pass < kAbsolutePasses) {
      for (std::size_t i = 0; i < all.size(); ++i) weight_[i] = 1 / std::max(all[i].distance, 0.02);
      return;
    }
    // The median distance of a two-dimensional normal distribution is 1.1774 sigmas. The lower limit is for
    // exact maps.
    const double sigma = std::max(median_distance(all, scratch_) / 1.1774, 0.02);
    for (std::size_t i = 0; i < all.size(); ++i) weight_[i] = tukey_weight(all[i].distance / sigma);
  }

  double outlier_;
  std::vector<double> weight_, scratch_;
};

void gather(const PixelMap& map, int row, int col, int reach, std::vector<Neighbour>& out) {
  out.clear();
  for (int r = std::max(row - reach, 0); r <= std::min(row + reach, map.camera.rows - 1); ++r)
    for (int c = std::max(col - reach, 0); c <= std::min(col + reach, map.camera.cols - 1); ++c)
      if (map.mask.at(r, c) && (r != row || c != col))
        out.push_back({static_cast<double>(c - col), static_cast<double>(r - row),
                       position_or_zero(map.col.at(r, c)), position_or_zero(map.row.at(r, c))});
}

constexpr float kNotJudged = std::numeric_limits<float>::quiet_NaN();

/// The contrast of a lit pixel. Photographs that use less than a quarter of their range need less: 12-bit
/// codes in 16-bit files use a sixteenth.
double least_contrast(const PixelMap& map, const MapQualityOptions& options) {
  constexpr double kBright = 0.99, kUsualRange = 0.25;
  const auto values = map.contrast.values();
  const auto bright =
      static_cast<double>(quantile(std::vector<float>(values.begin(), values.end()), kBright));
  return options.lit_contrast * std::clamp(bright / kUsualRange, 0.0, 1.0);
}

/// Counts over the judged pixels.
struct Count {
  double axes = 2;  // that the map knows
  double judged = 0, alone = 0, outliers = 0, axis_outliers = 0, squares = 0;

  void add(double dcol, double drow, double outlier) {
    judged += 1;
    if (std::isnan(dcol)) {
      alone += 1;
      return;
    }
    const double distance = length(dcol, drow);
    outliers += distance > outlier ? 1 : 0;
    axis_outliers += ((std::abs(dcol) > outlier ? 1 : 0) + (std::abs(drow) > outlier ? 1 : 0)) / axes;
    squares += distance > outlier ? 0 : distance * distance / axes;
  }

  void tell(MapQuality& quality) const {
    if (judged == 0) return;
    quality.alone_share = alone / judged;
    quality.outlier_share = (outliers + alone) / judged;
    quality.axis_outlier_share = (axis_outliers + alone) / judged;
    const double rest = judged - outliers - alone;
    quality.rms = rest > 0 ? std::sqrt(squares / rest) : 0;
  }
};

}  // namespace

float MapResiduals::distance(std::size_t pixel) const {
  return static_cast<float>(
      length(static_cast<double>(col.values()[pixel]), static_cast<double>(row.values()[pixel])));
}

MapResiduals map_residuals(const PixelMap& map, const MapQualityOptions& options) {
  MapResiduals residuals{Image<float>(map.camera, 1, kNotJudged), Image<float>(map.camera, 1, kNotJudged)};
  const int rows = (map.camera.rows + options.stride - 1) / options.stride;
  tbb::parallel_for(tbb::blocked_range<int>(0, rows, 4), [&](const tbb::blocked_range<int>& range) {
    RobustFit robust(options.outlier);
    std::vector<Neighbour> neighbours;
    for (int row = range.begin() * options.stride;
         row < range.end() * options.stride && row < map.camera.rows; row += options.stride)
      for (int col = 0; col < map.camera.cols; col += options.stride) {
        if (!map.mask.at(row, col)) continue;
        gather(map, row, col, options.reach, neighbours);
        if (static_cast<int>(neighbours.size()) < options.least) continue;
        const auto fit = robust(neighbours);
        if (!fit) continue;
        residuals.col.at(row, col) =
            static_cast<float>(position_or_zero(map.col.at(row, col)) - (*fit)(0, 0));
        residuals.row.at(row, col) =
            static_cast<float>(position_or_zero(map.row.at(row, col)) - (*fit)(0, 1));
      }
  });
  return residuals;
}

MapQuality judge_map(const PixelMap& map, const MapQualityOptions& options) {
  return judge_map(map, map_residuals(map, options), options);
}

MapQuality judge_map(const PixelMap& map, const MapResiduals& residuals, const MapQualityOptions& options) {
  double all = 0, valid = 0;
  const double least = least_contrast(map, options);
  Count count;
  count.axes = map.axes == CodeAxes::both ? 2 : 1;
  for (int row = 0; row < map.camera.rows; ++row)
    for (int col = 0; col < map.camera.cols; ++col) {
      const auto i = static_cast<std::size_t>(row) * static_cast<std::size_t>(map.camera.cols) +
                     static_cast<std::size_t>(col);
      if (static_cast<double>(map.contrast.values()[i]) <= least) continue;
      all += 1;
      valid += map.mask.values()[i];
      if (map.mask.values()[i] && row % options.stride == 0 && col % options.stride == 0)
        count.add(static_cast<double>(residuals.col.values()[i]),
                  static_cast<double>(residuals.row.values()[i]), options.outlier);
    }
  MapQuality quality;
  quality.lit_share = all / static_cast<double>(map.mask.values().size());
  quality.valid_share = all > 0 ? valid / all : 0;
  count.tell(quality);
  return quality;
}

}  // namespace symrig
