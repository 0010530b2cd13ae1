// SPDX-License-Identifier: Apache-2.0

#include "calibration/cells/shared_pixels.hpp"

#include "symrig/acquisition/internal/fast_crc32c.hpp"

#include <algorithm>
#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

constexpr std::size_t kBlock = 1024;
/// A pixel that sees more cells is left out.
constexpr std::size_t kMostParts = 16;
/// Noise alone gives a squared excess of this many variances of a pixel: its own, and as much from the planes
/// of its cells, which a core of about ten pixels tells at its border.
constexpr float kOfNoise = 2;

template <class Work>
void over(std::size_t count, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, kBlock), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) work(i);
  });
}

}  // namespace

void SharedPixels::add_cell(const Eigen::Matrix3d& normal, bool slopes, std::span<const CorePoint> places,
                            std::span<const float> light) {
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  if (slopes)
    inverse = normal.inverse();
  else if (normal(0, 0) > 0)
    inverse(0, 0) = 1 / normal(0, 0);
  Cell cell;
  std::size_t k = 0;
  for (int row = 0; row < 3; ++row)
    for (int col = row; col < 3; ++col) cell.inverse[k++] = static_cast<float>(inverse(row, col));
  cell_.push_back(cell);
  places_.insert(places_.end(), places.begin(), places.end());
  light_.insert(light_.end(), light.begin(), light.end());
  first_place_.push_back(static_cast<std::uint32_t>(places_.size()));
}

void SharedPixels::add_pixel(std::uint32_t pixel, float light, std::span<const CellShare> parts) {
  if (parts.size() > kMostParts) return;
  const auto first = static_cast<std::uint32_t>(parts_.size());
  parts_.insert(parts_.end(), parts.begin(), parts.end());
  pixels_.push_back({pixel, first, static_cast<std::uint32_t>(parts_.size()), light});
}

void SharedPixels::finish() {
  // Counting sort by cell, so that each cell collects its own parts.
  first_of_cell_.assign(cells_ + 1, 0);
  for (const CellShare& part : parts_) ++first_of_cell_[part.cell + 1];
  for (std::size_t i = 0; i < cells_; ++i) first_of_cell_[i + 1] += first_of_cell_[i];
  of_cell_.resize(parts_.size());
  std::vector<std::uint32_t> next(first_of_cell_.begin(), first_of_cell_.end() - 1);
  for (std::uint32_t part = 0; part < parts_.size(); ++part) of_cell_[next[parts_[part].cell]++] = part;
}

/// Least squares for y / W with weights W: the inverse of the normal matrix, times Σ y φ.
SharedPixels::RatioPlane SharedPixels::plane(const Photograph& photograph, std::size_t cell) const {
  const std::size_t begin = photograph.first[cell], places = first_place_[cell];
  const std::size_t count = first_place_[cell + 1] - places;
  float one = 0, row = 0, col = 0, reference = 0;
  bool all = true;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t pixel = photograph.pixel[begin + k];
    const CorePoint& place = places_[places + k];
    if (light_[places + k] == 0) continue;
    if (!photograph.valid[pixel]) {
      all = false;
      continue;
    }
    const float y = photograph.mean[pixel];
    one += y, row += y * place.row, col += y * place.col;
    reference += light_[places + k];
  }
  // A pixel that is missing is as bright as the others. Without any, the plane is 0.
  if (!all && reference > 0) {
    const float mean = one / reference;
    for (std::size_t k = 0; k < count; ++k) {
      if (photograph.valid[photograph.pixel[begin + k]]) continue;
      const float y = mean * light_[places + k];
      one += y, row += y * places_[places + k].row, col += y * places_[places + k].col;
    }
  }
  const auto& v = cell_[cell].inverse;
  return {v[0] * one + v[1] * row + v[2] * col, v[1] * one + v[3] * row + v[4] * col,
          v[2] * one + v[4] * row + v[5] * col};
}

// One photograph. The planes of all cells come first. Then each shared pixel: its excess e over what the
// planes say, and the part τ² / Σ τ² of it for each of its cells. Last, each cell adds its parts up. Every
// loop writes to places of its own, so the result is the same for any number of threads.
void SharedPixels::add(const Photograph& photograph, std::span<const float> scale, std::span<float> mean,
                       std::span<float> variance) const {
  // Kept from photograph to photograph: fresh memory takes as long as the rest.
  static thread_local std::vector<RatioPlane> kept_planes;
  static thread_local std::vector<Excess> kept_excess;
  kept_planes.resize(std::max(kept_planes.size(), cells_));
  kept_excess.resize(std::max(kept_excess.size(), parts_.size()));
  const std::span planes(kept_planes);
  const std::span excess(kept_excess);
  over(cells_, [&](std::size_t i) { planes[i] = plane(photograph, i); });

  // What each shared pixel sees beyond the planes, and each cell's part of it.
  over(pixels_.size(), [&](std::size_t k) {
    const Pixel& pixel = pixels_[k];
    const std::span<const CellShare> parts(parts_.data() + pixel.first, pixel.last - pixel.first);
    const std::span<Excess> of_parts = excess.subspan(pixel.first, parts.size());
    if (!photograph.valid[pixel.pixel]) {
      std::ranges::fill(of_parts, Excess());
      return;
    }
    float light = photograph.mean[pixel.pixel], sum = 0;
    const float noise = photograph.variance[pixel.pixel];
    std::array<float, kMostParts> tau;
    for (std::size_t j = 0; j < parts.size(); ++j) {
      const float r = pixel.light * ratio(planes[parts[j].cell], parts[j]);
      light -= parts[j].share * r;
      tau[j] = tau_square(parts[j], r, noise);
      sum += tau[j];
    }
    const float per_tau = sum > 0 ? 1 / sum : 0.F, beyond = light * light - kOfNoise * noise;
    // Without noise, black pixels have squares that are too small for floats, or planes that are too steep.
    if (!std::isfinite(per_tau) || !std::isfinite(sum) || !std::isfinite(beyond)) {
      std::ranges::fill(of_parts, Excess());
      return;
    }
    for (std::size_t j = 0; j < parts.size(); ++j) {
      const float share = tau[j] * per_tau, weight = parts[j].weight;
      of_parts[j] = {weight * share * light, weight * weight * share * (1 - share) * beyond};
    }
  });

  over(cells_, [&](std::size_t i) {
    if (scale[i] == 0) return;
    Excess sum;
    for (std::uint32_t k = first_of_cell_[i]; k < first_of_cell_[i + 1]; ++k) {
      const Excess& one = excess[of_cell_[k]];
      sum.light += one.light, sum.doubt += one.doubt;
    }
    mean[i] += scale[i] * sum.light;
    // Along a side of a cell the excess often has one cause, so the doubt may be larger. But errors are
    // estimated beyond the stated variance: if it is too large, it hides them.
    variance[i] += scale[i] * scale[i] * std::max(sum.doubt, 0.F);
  });
}

/// The cell is Σ k y over its core + Σ g (y − ŷ) over its shared pixels, with the part g of the excess that
/// the shares alone give. ŷ is a sum over the cores of all cells of these pixels: Σ y φᵀ N⁻¹ u with u = Σ g f
/// W φ.
double SharedPixels::noise(std::size_t cell, std::span<const float> k) const {
  struct Towards {
    std::uint32_t cell;
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
  };
  std::vector<Towards> others;
  double changed = 0, alone = 0;
  for (std::uint32_t j = first_of_cell_[cell]; j < first_of_cell_[cell + 1]; ++j) {
    const CellShare& part = parts_[of_cell_[j]];
    const auto after = std::ranges::upper_bound(pixels_, of_cell_[j], {}, &Pixel::first);
    const Pixel& pixel = *std::prev(after);
    const std::span<const CellShare> parts(parts_.data() + pixel.first, pixel.last - pixel.first);
    double sum = 0;
    for (const CellShare& p : parts) sum += std::pow(static_cast<double>(p.share), 2);
    if (sum == 0) continue;
    const double g = static_cast<double>(part.weight) * std::pow(static_cast<double>(part.share), 2) / sum;
    changed += g * g;
    for (const CellShare& p : parts) {
      auto to = std::ranges::find(others, p.cell, &Towards::cell);
      if (to == others.end()) to = others.insert(others.end(), Towards{p.cell});
      const Eigen::Vector3d at(1, static_cast<double>(p.row), static_cast<double>(p.col));
      to->u += g * static_cast<double>(p.share * pixel.light) * at;
    }
  }
  for (const Towards& to : others) {
    const Eigen::Vector3d towards = inverse(to.cell) * to.u;
    for (std::uint32_t j = first_place_[to.cell]; j < first_place_[to.cell + 1]; ++j) {
      if (light_[j] == 0) continue;
      const double away = towards.dot(
          Eigen::Vector3d(1, static_cast<double>(places_[j].row), static_cast<double>(places_[j].col)));
      const double weight = to.cell == cell ? static_cast<double>(k[j - first_place_[cell]]) : 0;
      changed += std::pow(weight - away, 2);
    }
  }
  for (const float weight : k) alone += std::pow(static_cast<double>(weight), 2);
  return alone > 0 && !others.empty() ? changed / alone : 1;
}

Eigen::Matrix3d SharedPixels::inverse(std::size_t cell) const {
  const auto at = [&](std::size_t k) { return static_cast<double>(cell_[cell].inverse[k]); };
  Eigen::Matrix3d matrix;
  matrix << at(0), at(1), at(2), at(1), at(3), at(4), at(2), at(4), at(5);
  return matrix;
}

std::uint32_t SharedPixels::digest() const {
  std::vector<std::uint32_t> parts;
  const auto add = [&](const auto& values) {
    parts.push_back(acquisition::fast_crc32c(std::as_bytes(std::span(values))));
  };
  add(cell_), add(places_), add(light_), add(pixels_), add(parts_);
  return acquisition::fast_crc32c(std::as_bytes(std::span(parts)));
}

}  // namespace symrig::calibration
