// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/cell_weights.hpp"

#include "acquisition/log/fast_crc32c.hpp"
#include "calibration/registration/blurred.hpp"
#include "calibration/registration/shared_pixels.hpp"
#include "calibration/registration/unmixing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include <Eigen/Dense>
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig {

using calibration::SharedPixels;

namespace {

/// [cells²] Mean square distance of a core's pixels from a line, below which they do not tell a plane.
constexpr double kLeastSpread = 5e-3;
/// A core with a smaller share of the cell's mean light does not tell what the cell looks like.
constexpr double kLeastCore = 0.125;
/// Of the core's light above its noise.
constexpr double kLeastSigmas = 5;

}  // namespace

/// Builds the weights of one corner map, then of the channels that use it.
class CellWeightsBuilder {
  class LightParts;

 public:
  CellWeightsBuilder(Grid cells, const WeightOptions& options) : cells_(cells), options_(options) {}

  /// A camera pixel and a cell that it overlaps.
  struct Part {
    std::uint32_t cell, pixel;
    float area;
    bool core;
    float row, col;             ///< the middle of the overlap, from the middle of the cell
    float whole;                ///< area of the pixel, inside and outside of the cells
    bool first_row, first_col;  ///< of the cells that the pixel sees
    bool two;                   ///< it sees at most two rows and two columns
    double share() const { return static_cast<double>(area / whole); }  ///< of the pixel
  };
  /// All overlaps, ordered by cell, then by pixel.
  std::vector<Part> overlaps(const CornerMap& corners) const;
  /// 1 for the cells that are measured by their core in these channels, which use corner map `index`.
  std::vector<std::uint8_t> cores(const std::vector<Part>& parts, const Radiance& flood,
                                  std::span<const int> channels, std::size_t index,
                                  const Image<float>* shares) const;
  /// The pixels of the cells: of their cores, or all.
  CellWeights::Rows rows(const std::vector<Part>& parts, const std::vector<std::uint8_t>& has_core) const;
  CellWeights::Channel channel(const std::vector<Part>& parts, const CellWeights::Rows& rows,
                               std::size_t index, const std::vector<std::uint8_t>& has_core,
                               const Radiance& flood, int number, const Image<float>* shares) const;

 private:
  std::size_t cells() const { return static_cast<std::size_t>(cells_.size()); }
  static bool is_narrow(const Outline& outline);
  bool is_core(const Outline& outline, int row, int col) const;
  std::vector<std::uint8_t> bright_cores(const std::vector<Part>& parts, const LightParts& shares,
                                         std::span<const float> light, std::span<const float> variance,
                                         std::span<const std::uint8_t> valid) const;
  static float add_core(std::span<const Part> parts, const LightParts& shares, std::span<const float> light,
                        std::span<const std::uint8_t> valid, double area, CellWeights::Channel& out,
                        SharedPixels& shared);
  static void add_nothing(std::span<const Part> parts, CellWeights::Channel& out, SharedPixels& shared);
  static float add_all(std::span<const Part> parts, const LightParts& shares, CellWeights::Channel& out,
                       SharedPixels& shared);
  void add_shared(const std::vector<Part>& parts, const std::vector<double>& areas, const LightParts& shares,
                  std::span<const float> light, std::span<const std::uint8_t> valid,
                  const CellWeights::Rows& rows, CellWeights::Channel& out, SharedPixels shared) const;

  Grid cells_;
  WeightOptions options_;
};

/// How much of a pixel belongs to a cell: by its light if the shares are known, else by its area.
class CellWeightsBuilder::LightParts {
 public:
  LightParts(const Image<float>* shares, std::size_t map) {
    if (shares == nullptr) return;
    row_ = shares->plane(2 * static_cast<int>(map));
    col_ = shares->plane(2 * static_cast<int>(map) + 1);
  }

  double area(const Part& p) const {
    if (row_.empty() || !p.two) return static_cast<double>(p.area);
    const auto row = static_cast<double>(row_[p.pixel]), col = static_cast<double>(col_[p.pixel]);
    if (row < 0 || col < 0) return static_cast<double>(p.area);
    return static_cast<double>(p.whole) * (p.first_row ? row : 1 - row) * (p.first_col ? col : 1 - col);
  }

 private:
  std::span<const float> row_, col_;
};

/// A pixel that sees more cells than this along an axis tells nothing of any of them. So a map that is wrong
/// costs no more than a right one.
bool CellWeightsBuilder::is_narrow(const Outline& outline) {
  constexpr double kWidest = 8;
  const auto [top, bottom] = std::ranges::minmax(outline, {}, &Point::row);
  const auto [left, right] = std::ranges::minmax(outline, {}, &Point::col);
  return bottom.row - top.row <= kWidest && right.col - left.col <= kWidest;
}

bool CellWeightsBuilder::is_core(const Outline& outline, int row, int col) const {
  const double m = options_.margin;
  return std::ranges::all_of(outline, [&](const Point& p) {
    return p.row >= row + m && p.row <= row + 1 - m && p.col >= col + m && p.col <= col + 1 - m;
  });
}

std::vector<CellWeightsBuilder::Part> CellWeightsBuilder::overlaps(const CornerMap& corners) const {
  const Grid camera{corners.grid().rows - 1, corners.grid().cols - 1};
  std::vector<std::vector<Part>> of_row(static_cast<std::size_t>(camera.rows));
  tbb::parallel_for(0, camera.rows, [&](int row) {
    std::vector<Overlap> scratch;
    for (int col = 0; col < camera.cols; ++col) {
      const Outline outline = outline_of(corners, row, col);
      if (!is_narrow(outline)) continue;
      cut_outline(outline, cells_, scratch);
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
            {.cell = static_cast<std::uint32_t>(std::int64_t{o.row} * cells_.cols + o.col),
             .pixel = pixel,
             .area = static_cast<float>(o.area),
             .core = scratch.size() == 1 && is_core(outline, o.row, o.col),
             .row = static_cast<float>(o.middle.row - o.row - 0.5),
             .col = static_cast<float>(o.middle.col - o.col - 0.5),
             .whole = static_cast<float>(whole),
             .first_row = o.row == first.row,
             .first_col = o.col == first.col,
             .two = two});
    }
  });

  // Counting sort by cell; pixels come in order already.
  std::vector<std::size_t> next(cells() + 1);
  for (const auto& parts : of_row)
    for (const Part& part : parts) ++next[part.cell + 1];
  for (std::size_t i = 0; i < cells(); ++i) next[i + 1] += next[i];
  std::vector<Part> sorted(next.back());
  for (const auto& parts : of_row)
    for (const Part& part : parts) sorted[next[part.cell]++] = part;
  return sorted;
}

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
  std::vector<SharedPixels::Place> places;
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
  std::vector<SharedPixels::Part> seen;
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

/// Of the cell with these weights k: (scale / Σ k W)² Σ k².
double CellWeights::Channel::noise_share(std::size_t cell, std::size_t begin, std::size_t end) const {
  double sum = 0, squares = 0;
  for (std::size_t j = begin; j < end; ++j) {
    sum += static_cast<double>(weight[j] * reference[j]);
    squares += std::pow(static_cast<double>(weight[j]), 2);
  }
  return squares * std::pow(static_cast<double>(scale[cell]) / sum, 2);
}

std::string_view to_string(Weighting weighting) {
  switch (weighting) {
    case Weighting::area:
      return "area";
    case Weighting::cores:
      return "cores";
    case Weighting::unmixed:
      return "unmixed";
  }
  return "";
}

namespace {

Result<void> check(Grid cells, std::span<const CornerMap> corners, const Radiance& flood) {
  const int channels = flood.mean.channels();
  if (!cells.valid() || corners.empty() ||
      (corners.size() != 1 && std::cmp_not_equal(corners.size(), channels)))
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} corner maps for photographs with {} channels", corners.size(), channels),
                 "give one map, or one for each channel"};
  const Grid camera = flood.mean.grid();
  for (const CornerMap& map : corners) {
    if (map.grid() != Grid{camera.rows + 1, camera.cols + 1} || map.channels() != 2)
      return Error{ErrorCode::size_mismatch,
                   fmt::format("a corner map is {}, but the flood-lit photograph is {}",
                               to_string(map.grid()), to_string(camera)),
                   "a corner map has one row and one column more than the photograph"};
    if (!std::ranges::all_of(map.values(), [](double v) { return std::isfinite(v); }))
      return Error{ErrorCode::bad_value, "a corner of a camera pixel is not a finite number",
                   "register the camera again"};
  }
  return {};
}

Result<void> check_shares(const Image<float>& shares, const Radiance& flood, std::size_t maps) {
  if (shares.grid() != flood.mean.grid() || std::cmp_not_equal(shares.channels(), 2 * maps))
    return Error{ErrorCode::size_mismatch, "the shares of light do not fit the photograph and the maps",
                 "register the camera again"};
  const auto known = [](float v) { return (v >= 0 && v <= 1) || v == kUnknownShare; };
  if (std::ranges::all_of(shares.values(), known)) return {};
  return Error{ErrorCode::bad_value, "a share of light is not between 0 and 1", "register the camera again"};
}

}  // namespace

Result<CellWeights> CellWeights::make(Grid cells, std::span<const CornerMap> corners, const Radiance& flood,
                                      const WeightOptions& options, const Image<float>* shares) {
  SYMRIG_CHECK(check(cells, corners, flood));
  if (shares != nullptr) SYMRIG_CHECK(check_shares(*shares, flood, corners.size()));
  CellWeights weights;
  weights.cells_ = cells;
  weights.camera_ = flood.mean.grid();
  weights.channels_ = flood.mean.channels();
  const CellWeightsBuilder builder(cells, options);
  double noise = 0, whole = 0, pixels = 0;
  std::int64_t counted = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const auto parts = builder.overlaps(corners[k]);
    for (const auto& part : parts) whole += static_cast<double>(part.area), pixels += part.share();
    std::vector<int> channels;
    for (int c = 0; c < weights.channels_; ++c)
      if (corners.size() == 1 || std::cmp_equal(k, c)) channels.push_back(c);
    const auto has_core = builder.cores(parts, flood, channels, k, shares);
    weights.rows_.push_back(builder.rows(parts, has_core));
    const Rows& rows = weights.rows_.back();
    for (const int c : channels)
      weights.channel_.push_back(builder.channel(parts, rows, k, has_core, flood, c, shares));
    const Channel& last = weights.channel_.back();
    for (std::size_t i = 0; i < last.scale.size(); ++i) {
      if (last.scale[i] == 0) continue;
      if (k == 0 && options.weighting == Weighting::cores && !has_core[i]) ++weights.without_core_;
      noise += last.noise_share(i, rows.first[i], rows.first[i + 1]) * static_cast<double>(last.noise[i]);
      ++counted;
    }
  }
  if (pixels > 0) weights.pixel_side_ = std::sqrt(whole / pixels);
  if (counted > 0) weights.noise_share_ = noise / static_cast<double>(counted);
  return weights;
}

Result<void> CellWeights::divide_by(const Image<float>& gain) {
  if (gain.grid() != cells_)
    return Error{
        ErrorCode::size_mismatch,
        fmt::format("gains of {} cells for weights of {}", to_string(gain.grid()), to_string(cells_)),
        "calibrate the rig again"};
  if (!std::ranges::all_of(gain.plane(0), [](float g) { return g > 0 && std::isfinite(g); }))
    return Error{ErrorCode::bad_value, "a gain is not above 0", "calibrate the rig again"};
  for (Channel& channel : channel_)
    for (std::size_t i = 0; i < channel.scale.size(); ++i) {
      channel.scale[i] /= gain.plane(0)[i];
      if (!channel.unit.empty()) channel.unit[i] /= gain.plane(0)[i];
    }
  return {};
}

Result<void> CellWeights::blur_by(double variance) {
  if (!(variance >= 0 && variance <= 1))
    return Error{ErrorCode::bad_value,
                 fmt::format("photographs cannot be blurred by a variance of {:.3g} cells", variance),
                 "focus camera and projector, or make the cells larger"};
  blur_ = std::sqrt(variance) / pixel_side_;
  // A mean over a cell of side 1, of a picture blurred by σ: ∫ (box * Gaussian)² = 1 − 2 σ / √π along an
  // axis.
  constexpr double kLeast = 0.3;
  const double axis = std::max(1 - 2 * std::sqrt(variance / std::numbers::pi), kLeast);
  blurred_noise_ = static_cast<float>(axis * axis);
  return {};
}

std::uint32_t CellWeights::digest() const {
  std::vector<std::uint32_t> parts;
  const auto add = [&](const auto& values) {
    parts.push_back(acquisition::fast_crc32c(std::as_bytes(std::span(values))));
  };
  for (const Rows& rows : rows_) add(rows.first), add(rows.pixel);
  for (const Channel& channel : channel_) {
    add(channel.weight), add(channel.reference), add(channel.scale);
    if (channel.shared) parts.push_back(channel.shared->digest());
  }
  parts.push_back(acquisition::fast_crc32c(std::as_bytes(std::span(&blur_, 1))));
  if (shift_) parts.push_back(acquisition::fast_crc32c(std::as_bytes(std::span(&*shift_, 1))));
  return acquisition::fast_crc32c(std::as_bytes(std::span(parts)));
}

std::int64_t CellWeights::valid_cells() const {
  return std::ranges::count_if(channel_.front().scale, [](float s) { return s > 0; });
}

Result<Radiance> CellWeights::gather(const Radiance& photograph) const {
  if (photograph.mean.grid() != camera_ || photograph.mean.channels() != channels_)
    return Error{
        ErrorCode::size_mismatch,
        fmt::format("the photograph is {} with {} channels, but the camera was registered with {} and {}",
                    to_string(photograph.mean.grid()), photograph.mean.channels(), to_string(camera_),
                    channels_),
        "register the camera again"};
  if (shift_) return unmix(photograph);
  return blur_ > 0 ? gather_sharp(calibration::blurred(photograph, blur_)) : gather_sharp(photograph);
}

Radiance CellWeights::unmix(const Radiance& photograph) const {
  Radiance cells = photograph;
  for (int c = 0; c < channels_; ++c) {
    const Channel& channel = channel_[static_cast<std::size_t>(c)];
    calibration::unmix(cells_, *shift_, photograph.mean.plane(c), photograph.valid.plane(c),
                       cells.mean.plane(c));
    const auto mean = cells.mean.plane(c), variance = cells.variance.plane(c);
    for (std::size_t i = 0; i < channel.scale.size(); ++i) {
      mean[i] *= channel.scale[i];
      variance[i] *= channel.scale[i] * channel.scale[i] * static_cast<float>(noise_share_);
    }
  }
  return cells;
}

Result<CellWeights> CellWeights::unmixing(Grid cells, int channels, Point shift) {
  if (!(std::abs(shift.row) <= largest_shift && std::abs(shift.col) <= largest_shift))
    return Error{
        ErrorCode::limit,
        fmt::format("the camera's pixels are off by {:+.2f} and {:+.2f} cells, and {:.2f} is the most "
                    "that can be corrected",
                    shift.row, shift.col, largest_shift),
        "align the rig, or use a camera with 2.2 pixels along the side of a cell"};
  CellWeights weights;
  weights.cells_ = weights.camera_ = cells;
  weights.channels_ = channels;
  weights.shift_ = shift;
  weights.noise_share_ = calibration::unmixed_noise(shift);
  weights.channel_.assign(static_cast<std::size_t>(channels),
                          {.scale = std::vector<float>(static_cast<std::size_t>(cells.size()), 1.F)});
  return weights;
}

Radiance CellWeights::gather_sharp(const Radiance& photograph) const {
  Radiance cells{Image<float>(cells_, channels_), Image<float>(cells_, channels_),
                 Image<std::uint8_t>(cells_, channels_)};
  for (int c = 0; c < channels_; ++c) {
    const Channel& channel = channel_[static_cast<std::size_t>(c)];
    const Rows& rows = rows_[channel.rows];
    const auto mean = photograph.mean.plane(c);
    const auto variance = photograph.variance.plane(c);
    const auto valid = photograph.valid.plane(c);
    const auto to_mean = cells.mean.plane(c);
    const auto to_variance = cells.variance.plane(c);
    const auto to_valid = cells.valid.plane(c);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, channel.scale.size(), 1024), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        float light = 0, reference = 0, noise = 0;
        for (std::size_t k = rows.first[i]; k < rows.first[i + 1]; ++k) {
          const std::size_t pixel = rows.pixel[k];
          if (!valid[pixel]) continue;
          const float w = channel.weight[k];
          light += w * mean[pixel];
          noise += w * w * variance[pixel];
          reference += w * channel.reference[k];
        }
        if (channel.scale[i] == 0 || !(reference > 0)) continue;
        const float scale = channel.scale[i] / reference;
        to_mean[i] = scale * light;
        to_variance[i] = scale * scale * noise * channel.noise[i] * blurred_noise_;
        to_valid[i] = 1;
      }
    });
    if (channel.shared)
      channel.shared->add({mean, variance, valid, rows.first, rows.pixel}, channel.unit, to_mean,
                          to_variance);
  }
  return cells;
}

}  // namespace symrig
