// SPDX-License-Identifier: Apache-2.0
#include "calibration/cells/cell_weights_builder.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include <Eigen/Dense>
#include <tbb/parallel_for.h>

namespace symrig::calibration {

namespace {

/// A pixel that sees more cells than this along an axis tells nothing of any of them. So a map that is wrong
/// costs no more than a right one.
bool is_narrow(const Outline& outline) {
  constexpr double kWidest = 8;
  const auto [top, bottom] = std::ranges::minmax(outline, {}, &Point::row);
  const auto [left, right] = std::ranges::minmax(outline, {}, &Point::col);
  return bottom.row - top.row <= kWidest && right.col - left.col <= kWidest;
}

bool is_core(const Outline& outline, int row, int col, double margin) {
  return std::ranges::all_of(outline, [&](const Point& p) {
    return p.row >= row + margin && p.row <= row + 1 - margin && p.col >= col + margin &&
           p.col <= col + 1 - margin;
  });
}

}  // namespace

std::vector<CellOverlap> cell_overlaps(Grid cells, const CornerMap& corners, double margin) {
  const Grid camera{corners.grid().rows - 1, corners.grid().cols - 1};
  std::vector<std::vector<CellOverlap>> of_row(static_cast<std::size_t>(camera.rows));
  tbb::parallel_for(0, camera.rows, [&](int row) {
    std::vector<Overlap> scratch;
    for (int col = 0; col < camera.cols; ++col) {
      const Outline outline = outline_of(corners, row, col);
      if (!is_narrow(outline)) continue;
      cut_outline(outline, cells, scratch);
      const auto pixel = static_cast<std::uint32_t>(std::int64_t{row} * camera.cols + col);
      if (scratch.empty()) continue;
      const double whole = area_of(outline);
      Overlap first = scratch.front(), last = first;
      for (const Overlap& o : scratch) {
        first.row = std::min(first.row, o.row), first.col = std::min(first.col, o.col);
        last.row = std::max(last.row, o.row), last.col = std::max(last.col, o.col);
      }
      const bool two = last.row - first.row <= 1 && last.col - first.col <= 1;
      for (const Overlap& o : scratch)
        of_row[static_cast<std::size_t>(row)].push_back(
            {.cell = static_cast<std::uint32_t>(std::int64_t{o.row} * cells.cols + o.col),
             .pixel = pixel,
             .area = static_cast<float>(o.area),
             .core = scratch.size() == 1 && is_core(outline, o.row, o.col, margin),
             .row = static_cast<float>(o.middle.row - o.row - 0.5),
             .col = static_cast<float>(o.middle.col - o.col - 0.5),
             .whole = static_cast<float>(whole),
             .first_row = o.row == first.row,
             .first_col = o.col == first.col,
             .two = two});
    }
  });

  // Counting sort by cell; pixels come in order already.
  const auto count = static_cast<std::size_t>(cells.size());
  std::vector<std::size_t> next(count + 1);
  for (const auto& parts : of_row)
    for (const CellOverlap& part : parts) ++next[part.cell + 1];
  for (std::size_t i = 0; i < count; ++i) next[i + 1] += next[i];
  std::vector<CellOverlap> sorted(next.back());
  for (const auto& parts : of_row)
    for (const CellOverlap& part : parts) sorted[next[part.cell]++] = part;
  return sorted;
}

}  // namespace symrig::calibration

namespace symrig {

namespace {

/// [cells²] Mean square distance of a core's pixels from a line, below which they do not tell a plane.
constexpr double kLeastSpread = 5e-3;
/// A core with a smaller share of the cell's mean light does not tell what the cell looks like.
constexpr double kLeastCore = 0.125;
/// Of the core's light above its noise.
constexpr double kLeastSigmas = 5;

}  // namespace

/// A cell whose core is nearly black next to the rest of the cell, or is not brighter than noise: the core
/// does not tell what the rest looks like.
std::vector<std::uint8_t> CellWeightsBuilder::bright_cores(const std::vector<Part>& parts,
                                                           const LightParts& shares,
                                                           std::span<const float> light,
                                                           std::span<const float> variance,
                                                           std::span<const std::uint8_t> valid) const {
  struct Sums {
    double core = 0, core_area = 0, noise = 0, whole = 0, area = 0;
  };
  std::vector<Sums> sums(cells());
  for (const Part& p : parts) {
    if (!valid[p.pixel]) continue;
    Sums& s = sums[p.cell];
    const auto w = static_cast<double>(light[p.pixel]);
    s.whole += shares.area(p) * w, s.area += static_cast<double>(p.area);
    if (!p.core) continue;
    s.core += w, s.core_area += 1, s.noise += static_cast<double>(variance[p.pixel]);
  }
  std::vector<std::uint8_t> bright(cells());
  std::ranges::transform(sums, bright.begin(), [](const Sums& s) -> std::uint8_t {
    const bool seen = s.core_area > 0 && s.core > kLeastSigmas * std::sqrt(s.noise);
    return seen && s.core / s.core_area > kLeastCore * s.whole / s.area;
  });
  return bright;
}

CellWeights::Rows CellWeightsBuilder::rows(const std::vector<Part>& parts,
                                           const std::vector<std::uint8_t>& has_core) const {
  CellWeights::Rows rows;
  rows.first.assign(cells() + 1, 0);
  for (const Part& part : parts) {
    if (has_core[part.cell] && !part.core) continue;
    ++rows.first[part.cell + 1];
    rows.pixel.push_back(part.pixel);
  }
  for (std::size_t i = 0; i < cells(); ++i) rows.first[i + 1] += rows.first[i];
  return rows;
}

std::vector<std::uint8_t> CellWeightsBuilder::cores(const std::vector<Part>& parts, const Radiance& flood,
                                                    std::span<const int> channels, std::size_t index,
                                                    const Image<float>* shares) const {
  std::vector<std::uint8_t> has_core(cells());
  if (options_.weighting != Weighting::cores) return has_core;
  std::ranges::fill(has_core, std::uint8_t{1});
  for (const int c : channels) {
    const auto bright = bright_cores(parts, LightParts(shares, index), flood.mean.plane(c),
                                     flood.variance.plane(c), flood.valid.plane(c));
    for (std::size_t i = 0; i < cells(); ++i) has_core[i] &= bright[i];
  }
  return has_core;
}

CellWeights::Channel CellWeightsBuilder::channel(const std::vector<Part>& parts,
                                                 const CellWeights::Rows& rows, std::size_t index,
                                                 const std::vector<std::uint8_t>& has_core,
                                                 const Radiance& flood, int number,
                                                 const Image<float>* shares) const {
  const auto light = flood.mean.plane(number);
  const auto valid = flood.valid.plane(number);
  CellWeights::Channel out{
      .rows = index, .scale = std::vector<float>(cells()), .noise = std::vector<float>(cells(), 1.F)};
  SharedPixels shared_pixels(cells());
  const LightParts by_light(options_.weighting == Weighting::cores ? shares : nullptr, index);
  std::vector<double> areas(cells());
  out.weight.reserve(rows.pixel.size());
  out.reference.reserve(rows.pixel.size());
  out.light.reserve(rows.pixel.size());
  auto begin = parts.begin();
  for (std::uint32_t cell = 0; cell < cells(); ++cell) {
    const auto end = std::find_if(begin, parts.end(), [&](const Part& p) { return p.cell != cell; });
    double seen = 0, area = 0;
    for (auto p = begin; p != end; ++p) {
      seen += static_cast<double>(p->area);
      if (valid[p->pixel]) area += static_cast<double>(p->area);
    }
    const bool good = seen >= options_.least_cover && area > 0;
    if (has_core[cell] && good) {
      out.scale[cell] = add_core({begin, end}, by_light, light, valid, area, out, shared_pixels);
      areas[cell] = out.scale[cell] > 0 ? area : 0;
    } else if (has_core[cell]) {
      add_nothing({begin, end}, out, shared_pixels);
    } else {
      const float scale = add_all({begin, end}, by_light, out, shared_pixels);
      out.scale[cell] = good ? scale : 0.F;
    }
    begin = end;
  }
  for (const std::uint32_t pixel : rows.pixel)
    out.light.push_back(valid[pixel] ? std::max(light[pixel], 0.F) : 0.F);
  out.unit.resize(cells());
  std::ranges::transform(out.scale, out.unit.begin(), [](float s) { return s > 0 ? 1.F : 0.F; });
  if (options_.weighting == Weighting::cores)
    add_shared(parts, areas, by_light, light, valid, rows, out, std::move(shared_pixels));
  return out;
}

/// The weights of a cell's core: the least noise of Σ k y, with a variance of y ∝ W, such that Σ k W φ = Σ A
/// W φ / Σ A for φ = 1, row, col. So k = λ · φ. Where the core lies on a line, for φ = 1 only. Returns Σ k W.
float CellWeightsBuilder::add_core(std::span<const Part> parts, const LightParts& shares,
                                   std::span<const float> light, std::span<const std::uint8_t> valid,
                                   double area, CellWeights::Channel& out, SharedPixels& shared) {
  Eigen::Matrix3d core = Eigen::Matrix3d::Zero();
  Eigen::Vector3d whole = Eigen::Vector3d::Zero();
  const auto shape = [](const Part& p) {
    return Eigen::Vector3d(1, static_cast<double>(p.row), static_cast<double>(p.col));
  };
  for (const Part& p : parts) {
    if (!valid[p.pixel]) continue;
    const auto w = static_cast<double>(light[p.pixel]);
    whole += shares.area(p) / area * w * shape(p);
    if (p.core) core.noalias() += w * shape(p) * shape(p).transpose();
  }
  const Eigen::LDLT<Eigen::Matrix3d> factor(core);
  const bool plane = factor.vectorD().minCoeff() > kLeastSpread * core(0, 0);
  const Eigen::Vector3d k =
      plane ? Eigen::Vector3d(factor.solve(whole)) : Eigen::Vector3d(whole[0] / core(0, 0), 0, 0);
  float sum = 0;
  std::vector<SharedPixels::CorePoint> places;
  const std::size_t first = out.reference.size();
  for (const Part& p : parts) {
    if (!p.core) continue;
    const float w = valid[p.pixel] ? light[p.pixel] : 0.F;
    out.weight.push_back(valid[p.pixel] ? static_cast<float>(k.dot(shape(p))) : 0.F);
    out.reference.push_back(w);
    places.push_back({p.row, p.col});
    sum += out.weight.back() * w;
  }
  const bool good = core(0, 0) > 0 && sum > 0;
  shared.add_cell(good ? core : Eigen::Matrix3d::Zero().eval(), plane && good, places,
                  std::span(out.reference).subspan(first));
  return good ? sum : 0.F;
}

/// A cell that is not valid.
void CellWeightsBuilder::add_nothing(std::span<const Part> parts, CellWeights::Channel& out,
                                     SharedPixels& shared) {
  const auto cores = static_cast<std::size_t>(std::ranges::count_if(parts, &Part::core));
  out.weight.insert(out.weight.end(), cores, 0.F);
  out.reference.insert(out.reference.end(), cores, 0.F);
  shared.add_cell(Eigen::Matrix3d::Zero(), false, {}, {});
}

/// Without a core, all pixels count: by area, or by light where the shares tell, so that the light of
/// neighbours does not. Returns the sum of the weights, divided by the area.
float CellWeightsBuilder::add_all(std::span<const Part> parts, const LightParts& shares,
                                  CellWeights::Channel& out, SharedPixels& shared) {
  /// A cell with less is as black as its shares are wrong.
  constexpr double kLeastLight = 0.001;
  double light = 0, area = 0;
  for (const Part& p : parts) light += shares.area(p), area += static_cast<double>(p.area);
  const bool by_light = light > kLeastLight * area;
  for (const Part& p : parts) {
    out.weight.push_back(by_light ? static_cast<float>(shares.area(p)) : p.area);
    out.reference.push_back(1);
  }
  shared.add_cell(Eigen::Matrix3d::Zero(), false, {}, {});
  return by_light ? static_cast<float>(light / area) : 1.F;
}

/// Adds the pixels that no core has, and that see measured cells only. areas: of each cell that is measured
/// by its core; 0: another.
void CellWeightsBuilder::add_shared(const std::vector<Part>& parts, const std::vector<double>& areas,
                                    const LightParts& shares, std::span<const float> light,
                                    std::span<const std::uint8_t> valid, const CellWeights::Rows& rows,
                                    CellWeights::Channel& out, SharedPixels shared) const {
  // The light beyond the outermost cells is not known.
  constexpr double kWhole = 1 - 1e-5;
  // Counting sort by pixel.
  std::vector<std::uint32_t> next(light.size() + 1), order(parts.size());
  for (const Part& p : parts) ++next[p.pixel + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  for (std::uint32_t k = 0; k < parts.size(); ++k) order[next[parts[k].pixel]++] = k;
  std::vector<SharedPixels::CellShare> seen;
  for (auto begin = order.begin(); begin != order.end();) {
    const std::uint32_t pixel = parts[*begin].pixel;
    const auto end = std::find_if(begin, order.end(), [&](auto k) { return parts[k].pixel != pixel; });
    seen.clear();
    double covered = 0;
    bool good = valid[pixel] && light[pixel] > 0;
    for (auto k = begin; k != end; ++k) {
      const Part& p = parts[*k];
      covered += p.share();
      good = good && !p.core && areas[p.cell] > 0;
      if (good)
        seen.push_back({p.cell, p.row, p.col,
                        static_cast<float>(shares.area(p) / static_cast<double>(p.whole)),
                        static_cast<float>(static_cast<double>(p.whole) / areas[p.cell])});
    }
    if (good && covered > kWhole) shared.add_pixel(pixel, light[pixel], seen);
    begin = end;
  }
  shared.finish();
  tbb::parallel_for(std::size_t{0}, cells(), [&](std::size_t i) {
    const std::span weights = std::span(out.weight).subspan(rows.first[i], rows.first[i + 1] - rows.first[i]);
    if (areas[i] > 0) out.noise[i] = static_cast<float>(shared.noise(i, weights));
  });
  out.shared = std::make_shared<const SharedPixels>(std::move(shared));
}

}  // namespace symrig
