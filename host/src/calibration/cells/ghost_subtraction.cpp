// SPDX-License-Identifier: Apache-2.0

#include "calibration/cells/ghost_subtraction.hpp"

#include "symrig/acquisition/internal/fast_crc32c.hpp"
#include "symrig/calibration/camera_optics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// Share of the light that may be left of a ghost.
constexpr double kLeft = 1e-5;
/// A map bends by some hundredths over a ghost's distance, so each step of Newton's method leaves some
/// hundredths of the last error.
constexpr int kSteps = 4;

/// The map between the corners of a picture, and beyond its border.
Point look(const CornerMap& corners, double row, double col) {
  const int r = static_cast<int>(std::clamp(row, 0.0, corners.grid().rows - 2.0));
  const int c = static_cast<int>(std::clamp(col, 0.0, corners.grid().cols - 2.0));
  const double down = row - r, right = col - c;
  const auto at = [&](int plane) {
    const double upper = (1 - right) * corners.at(r, c, plane) + right * corners.at(r, c + 1, plane);
    const double lower = (1 - right) * corners.at(r + 1, c, plane) + right * corners.at(r + 1, c + 1, plane);
    return (1 - down) * upper + down * lower;
  };
  return {at(0), at(1)};
}

}  // namespace

Point displaced_pixel(const CornerMap& corners, int row, int col, Point by) {
  const Point here = look(corners, row + 0.5, col + 0.5);
  const Point up = look(corners, row, col + 0.5), below = look(corners, row + 1, col + 0.5);
  const Point left = look(corners, row + 0.5, col), after = look(corners, row + 0.5, col + 1);
  const double a = below.row - up.row, b = after.row - left.row;
  const double c = below.col - up.col, d = after.col - left.col;
  const double determinant = a * d - b * c;
  double r = row + 0.5, q = col + 0.5;
  for (int step = 0; step < kSteps; ++step) {
    const Point there = look(corners, r, q);
    const double down = here.row + by.row - there.row, right = here.col + by.col - there.col;
    r += (d * down - b * right) / determinant;
    q += (a * right - c * down) / determinant;
    if (!std::isfinite(r) || !std::isfinite(q)) return {-2, -2};
  }
  return {r - 0.5, q - 0.5};
}

Mixed PhotographPlane::at(float row, float col) const {
  const auto inside = [](float x, int size) { return x > -1.F && x < static_cast<float>(size); };
  if (!inside(row, grid.rows) || !inside(col, grid.cols)) return {};
  const auto r = static_cast<int>(std::floor(row)), c = static_cast<int>(std::floor(col));
  const float down = row - static_cast<float>(r), right = col - static_cast<float>(c);
  Mixed out;
  float all = 0, weights = 0;
  const auto add = [&](int i, int j, float weight) {
    if (i < 0 || j < 0 || i >= grid.rows || j >= grid.cols) return;
    const auto pixel = static_cast<std::size_t>(std::int64_t{i} * grid.cols + j);
    all += weight;
    if (!valid[pixel]) return;
    weights += weight;
    out.mean += weight * mean[pixel];
    out.variance += weight * weight * variance[pixel];
  };
  add(r, c, (1 - down) * (1 - right)), add(r, c + 1, (1 - down) * right);
  add(r + 1, c, down * (1 - right)), add(r + 1, c + 1, down * right);
  // A weight of rounding errors tells nothing.
  constexpr float kLeastWeight = 1e-3F;
  out.inside = all >= kLeastWeight;
  if (weights < kLeastWeight) return {.inside = out.inside};
  out.mean /= weights, out.variance /= weights * weights, out.known = true;
  return out;
}

PhotographPlane plane_of(const Radiance& photograph, int channel) {
  return {photograph.mean.grid(), photograph.mean.plane(channel), photograph.variance.plane(channel),
          photograph.valid.plane(channel)};
}

Result<GhostSubtraction> GhostSubtraction::make(std::span<const CornerMap> corners, double share,
                                                Point place) {
  if (!(share >= 0 && share <= CameraGhost::largest_share) || !std::isfinite(place.row) ||
      !std::isfinite(place.col))
    return Error{ErrorCode::bad_value, fmt::format("no ghost has a share of {:.3g} of the light", share),
                 "calibrate the rig again"};
  GhostSubtraction out;
  out.share_ = share;
  for (const CornerMap& map : corners) {
    const Grid camera{map.grid().rows - 1, map.grid().cols - 1};
    Image<float> from(camera, 2);
    tbb::parallel_for(0, camera.rows, [&](int row) {
      // What is far outside stays so as a float.
      const auto kept = [](double v) { return static_cast<float>(std::clamp(v, -2.0, 1e6)); };
      for (int col = 0; col < camera.cols; ++col) {
        const Point at = displaced_pixel(map, row, col, place);
        from.at(row, col, 0) = kept(at.row), from.at(row, col, 1) = kept(at.col);
      }
    });
    out.from_.push_back(std::move(from));
  }
  return out;
}

/// x = (y − share · x displaced) / (1 − share). The error of x shrinks by share / (1 − share) each time.
Image<float> GhostSubtraction::light_without(const Radiance& photograph, int channel) const {
  const Image<float>& from = from_[from_.size() == 1 ? 0 : static_cast<std::size_t>(channel)];
  const PhotographPlane seen = plane_of(photograph, channel);
  const auto share = static_cast<float>(share_);
  Image<float> now(seen.grid), next(seen.grid);
  std::ranges::copy(seen.mean, now.plane(0).begin());
  const double shrinks = share_ / (1 - share_);
  double left = shrinks;
  while (left > kLeft) {
    const PhotographPlane known{seen.grid, now.plane(0), seen.variance, seen.valid};
    tbb::parallel_for(0, seen.grid.rows, [&](int row) {
      for (int col = 0; col < seen.grid.cols; ++col) {
        const auto pixel = static_cast<std::size_t>(std::int64_t{row} * seen.grid.cols + col);
        const Mixed ghost = known.at(from.at(row, col, 0), from.at(row, col, 1));
        next.values()[pixel] = (seen.mean[pixel] - share * ghost.mean) / (1 - share);
      }
    });
    std::swap(now, next);
    left *= shrinks;
  }
  return now;
}

Radiance GhostSubtraction::operator()(const Radiance& photograph) const {
  Radiance out = photograph;
  const auto share = static_cast<float>(share_);
  for (int c = 0; c < photograph.mean.channels(); ++c) {
    const Image<float>& from = from_[from_.size() == 1 ? 0 : static_cast<std::size_t>(c)];
    const Image<float> light = light_without(photograph, c);
    const PhotographPlane seen = plane_of(photograph, c);
    tbb::parallel_for(0, seen.grid.rows, [&](int row) {
      for (int col = 0; col < seen.grid.cols; ++col) {
        if (!photograph.valid.at(row, col, c)) continue;
        const Mixed ghost = seen.at(from.at(row, col, 0), from.at(row, col, 1));
        const bool good = ghost.known || !ghost.inside;
        out.valid.at(row, col, c) = good ? 1 : 0;
        out.mean.at(row, col, c) = good ? light.at(row, col) : 0.F;
        const float variance = photograph.variance.at(row, col, c) + share * share * ghost.variance;
        out.variance.at(row, col, c) = good ? variance / ((1 - share) * (1 - share)) : 0.F;
      }
    });
  }
  return out;
}

std::uint32_t GhostSubtraction::digest() const {
  std::vector<std::uint32_t> parts{acquisition::fast_crc32c(std::as_bytes(std::span(&share_, 1)))};
  for (const Image<float>& from : from_)
    parts.push_back(acquisition::fast_crc32c(std::as_bytes(from.values())));
  return acquisition::fast_crc32c(std::as_bytes(std::span(parts)));
}

}  // namespace symrig::calibration

namespace symrig {

Result<Radiance> without_ghost(const Radiance& photograph, std::span<const CornerMap> corners,
                               const CameraGhost& ghost) {
  const Grid camera = photograph.mean.grid();
  const bool fit = std::ranges::all_of(corners, [&](const CornerMap& map) {
    return map.grid() == Grid{camera.rows + 1, camera.cols + 1} && map.channels() == 2;
  });
  if (!fit || corners.empty() ||
      (corners.size() != 1 && std::cmp_not_equal(corners.size(), photograph.mean.channels())))
    return Error{ErrorCode::size_mismatch, "the maps do not fit the photograph", "calibrate the rig again"};
  SYMRIG_TRY(const auto subtract, calibration::GhostSubtraction::make(corners, ghost.share, ghost.place));
  return subtract(photograph);
}

}  // namespace symrig
