// SPDX-License-Identifier: Apache-2.0
#include "calibration/pixel_map/raw_map.hpp"
#include "symrig/calibration/pixel_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig {
namespace {

/// Shares of a box along one axis of the projector: pixel first + k gets share[k], Σ = 1.
struct Shares {
  int first = 0;
  std::vector<double> share;
};

/// Whether the box lies completely on the projector, with a tolerance for rounding of 32-bit positions.
bool lies_inside(double centre, double width, int size) {
  const double rounding = 4 * static_cast<double>(std::numeric_limits<float>::epsilon()) * (size + width);
  return centre - width / 2 >= -0.5 - rounding && centre + width / 2 <= size - 0.5 + rounding;
}

/// Divides the box [centre − width / 2, centre + width / 2) into pixels j = [j − ½, j + ½). The part outside
/// the border goes to the pixels inside.
void cut(double centre, double width, int size, Shares& out) {
  const double low = centre - width / 2, high = centre + width / 2;
  out.first = std::clamp(static_cast<int>(std::floor(low + 0.5)), 0, size - 1);
  const int last = std::clamp(static_cast<int>(std::floor(high + 0.5)), out.first, size - 1);
  out.share.clear();
  double sum = 0;
  for (int j = out.first; j <= last; ++j) {
    out.share.push_back(std::max(std::min(high, j + 0.5) - std::max(low, j - 0.5), 0.0));
    sum += out.share.back();
  }
  if (!(sum > 0)) {  // the whole box lies outside the border, or its width is 0
    out.share.assign(1, 1);
    out.first = std::clamp(static_cast<int>(std::floor(centre + 0.5)), 0, size - 1);
    return;
  }
  for (double& s : out.share) s /= sum;
}

/// Camera pixels completely on the projector give the mean of a projector pixel if their share of its light
/// is at least this. A smaller part of one shows mostly the neighbours.
constexpr float kLeastInside = 1e-3F;

/// The step of the map from one camera pixel to the next.
class Spread {
 public:
  explicit Spread(const PixelMap& map)
      : map_(map), usual_(calibration::typical_scale({{map.col, map.row}, map.mask})) {}

  /// Side of a camera pixel's box along one axis of the projector [projector pixels].
  double side(const Image<float>& position, int row, int col) const {
    return step(position, row, col, 1, 0) + step(position, row, col, 0, 1);
  }

 private:
  /// The step to one neighbour, or the mean of both; other surfaces do not count.
  double step(const Image<float>& position, int row, int col, int down, int right) const {
    const double largest = calibration::Neighbourhood{.scale = usual_}.largest_step(1);
    double sum = 0;
    int count = 0;
    for (const int sign : {-1, 1}) {
      const int r = row + sign * down, c = col + sign * right;
      if (r < 0 || r >= map_.camera.rows || c < 0 || c >= map_.camera.cols || !map_.mask.at(r, c)) continue;
      const double found = sign * static_cast<double>(position.at(r, c) - position.at(row, col));
      if (std::abs(found) > largest) continue;
      sum += found;
      ++count;
    }
    return count == 0 ? usual_ / 2 : std::abs(sum / count);
  }

  const PixelMap& map_;
  double usual_;
};

Result<void> check(const PixelMap& map) {
  SYMRIG_CHECK(require_both_axes(map, "resampling"));
  for (const Grid grid : {map.col.grid(), map.row.grid(), map.mask.grid()})
    if (grid != map.camera)
      return Error{ErrorCode::size_mismatch, fmt::format("the map's camera is {}, one of its images is {}",
                                                         to_string(map.camera), to_string(grid))};
  const auto inside = [](float x, int size) { return x >= -1 && x <= static_cast<float>(size); };
  for (int row = 0; row < map.camera.rows; ++row)
    for (int col = 0; col < map.camera.cols; ++col)
      if (map.mask.at(row, col) && !(inside(map.col.at(row, col), map.projector.cols) &&
                                     inside(map.row.at(row, col), map.projector.rows)))
        return Error{
            ErrorCode::bad_value,
            fmt::format("camera pixel ({}, {}) looks at ({:g}, {:g}), outside a projector of {}", row, col,
                        map.row.at(row, col), map.col.at(row, col), to_string(map.projector)),
            "decode the photographs again, or check the map's file"};
  return {};
}

Result<void> check_grid(const Image<float>& image, Grid grid, const char* whose) {
  if (image.grid() == grid) return {};
  return Error{ErrorCode::size_mismatch, fmt::format("the picture is {}; the map's {} is {}",
                                                     to_string(image.grid()), whose, to_string(grid))};
}

}  // namespace

Result<Resampling> Resampling::from_map(const PixelMap& map) {
  SYMRIG_CHECK(check(map));
  Resampling made(map.camera, map.projector);
  const Spread spread(map);
  Shares cols, rows;
  for (int row = 0; row < map.camera.rows; ++row)
    for (int col = 0; col < map.camera.cols; ++col) {
      made.first_.push_back(static_cast<std::uint32_t>(made.weight_.size()));
      if (!map.mask.at(row, col)) continue;
      const auto x = static_cast<double>(map.col.at(row, col)), y = static_cast<double>(map.row.at(row, col));
      const double wide = spread.side(map.col, row, col), high = spread.side(map.row, row, col);
      cut(x, wide, map.projector.cols, cols);
      cut(y, high, map.projector.rows, rows);
      made.inside_.at(row, col) =
          lies_inside(x, wide, map.projector.cols) && lies_inside(y, high, map.projector.rows) ? 1 : 0;
      for (std::size_t i = 0; i < rows.share.size(); ++i)
        for (std::size_t j = 0; j < cols.share.size(); ++j) {
          if (!(rows.share[i] * cols.share[j] > 0)) continue;
          made.pixel_.push_back(static_cast<std::uint32_t>(
              (rows.first + static_cast<int>(i)) * map.projector.cols + cols.first + static_cast<int>(j)));
          made.weight_.push_back(static_cast<float>(rows.share[i] * cols.share[j]));
        }
    }
  made.first_.push_back(static_cast<std::uint32_t>(made.weight_.size()));
  SYMRIG_TRY(made.coverage_, made.to_projector(Image<float>(map.camera, 1, 1)));
  SYMRIG_TRY(made.inside_coverage_, made.to_projector(made.inside_));
  return made;
}

Result<Image<float>> Resampling::to_projector(const Image<float>& camera) const {
  SYMRIG_CHECK(check_grid(camera, camera_, "camera"));
  Image<float> result(projector_, camera.channels());
  std::vector<double> sum(projector_.size());
  for (int channel = 0; channel < camera.channels(); ++channel) {
    std::ranges::fill(sum, 0);
    const auto seen = camera.plane(channel);
    for (std::size_t i = 0; i < seen.size(); ++i)
      for (std::size_t k = first_[i]; k < first_[i + 1]; ++k)
        sum[pixel_[k]] += static_cast<double>(weight_[k]) * static_cast<double>(seen[i]);
    std::ranges::transform(sum, result.plane(channel).begin(),
                           [](double s) { return static_cast<float>(s); });
  }
  return result;
}

Result<Image<float>> Resampling::to_camera(const Image<float>& projector) const {
  SYMRIG_CHECK(check_grid(projector, projector_, "projector"));
  Image<float> result(camera_, projector.channels());
  for (int channel = 0; channel < projector.channels(); ++channel) {
    const auto shown = projector.plane(channel);
    const auto seen = result.plane(channel);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, seen.size(), 4096),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t i = range.begin(); i != range.end(); ++i) {
                          double sum = 0;
                          for (std::size_t k = first_[i]; k < first_[i + 1]; ++k)
                            sum += static_cast<double>(weight_[k]) * static_cast<double>(shown[pixel_[k]]);
                          seen[i] = static_cast<float>(sum);
                        }
                      });
  }
  return result;
}

Result<Image<float>> Resampling::mean_on_projector(const Image<float>& camera) const {
  SYMRIG_TRY(Image<float> mean, to_projector(camera));
  Image<float> whole = camera;
  for (int channel = 0; channel < whole.channels(); ++channel)
    std::ranges::transform(whole.plane(channel), inside_.values(), whole.plane(channel).begin(),
                           [](float x, float inside) { return inside > 0 ? x : 0; });
  SYMRIG_TRY(const Image<float> inside, to_projector(whole));
  const auto all = coverage_.values(), enough = inside_coverage_.values();
  for (int channel = 0; channel < mean.channels(); ++channel) {
    const auto plane = mean.plane(channel);
    const auto better = inside.plane(channel);
    for (std::size_t j = 0; j < plane.size(); ++j)
      if (enough[j] > kLeastInside * all[j])
        plane[j] = better[j] / enough[j];
      else
        plane[j] = all[j] > 0 ? plane[j] / all[j] : 0;
  }
  return mean;
}

}  // namespace symrig
