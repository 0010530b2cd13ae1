// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/first_bounce.hpp"

#include "calibration/first_bounce/light_model.hpp"
#include "calibration/pixel_map/raw_map.hpp"
#include "calibration/sequence/sequence_check.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

/// inverse[raster index] = tree index.
std::vector<std::int32_t> tree_index(const BlockTree& tree) {
  std::vector<std::int32_t> inverse(tree.order().size());
  for (std::size_t i = 0; i < inverse.size(); ++i) inverse[tree.order()[i]] = static_cast<std::int32_t>(i);
  return inverse;
}

/// A sparse matrix, column by column.
struct SparseColumns {
  std::vector<std::int64_t> first;  ///< of each column, and the end
  std::vector<std::int32_t> row;
  std::vector<float> value;

  std::size_t begin(std::size_t column) const { return static_cast<std::size_t>(first[column]); }
  std::size_t count(std::size_t column) const {
    return static_cast<std::size_t>(first[column + 1] - first[column]);
  }
  std::span<const std::int32_t> rows_of(std::size_t column) const {
    return std::span(row).subspan(begin(column), count(column));
  }
  std::span<const float> values_of(std::size_t column) const {
    return std::span(value).subspan(begin(column), count(column));
  }
};

/// Sorts entries by column in two passes. visit(take) calls take(column, row, value) for every entry; it must
/// do the same both times.
template <class Visit>
SparseColumns gather(std::size_t columns, Visit visit) {
  SparseColumns sparse;
  sparse.first.assign(columns + 1, 0);
  visit([&](std::size_t column, std::int32_t, float) { ++sparse.first[column + 1]; });
  std::partial_sum(sparse.first.begin(), sparse.first.end(), sparse.first.begin());
  sparse.row.resize(sparse.first.back());
  sparse.value.resize(sparse.row.size());
  std::vector<std::int64_t> next(sparse.first.begin(), sparse.first.end() - 1);
  visit([&](std::size_t column, std::int32_t row, float value) {
    const std::size_t slot = next[column]++;
    sparse.row[slot] = row;
    sparse.value[slot] = value;
  });
  return sparse;
}

/// Calls take(row tap, column tap, weight) for each weight of a separable footprint that is at least `least`
/// of the largest.
template <class Take>
void for_each_weight(const Footprint& f, float least, Take take) {
  for (int r = 0; r < f.row.count; ++r)
    for (int c = 0; c < f.col.count; ++c)
      if (const float w = f.row.weight[r] * f.col.weight[c]; w >= least)
        take(f.row.first + r, f.col.first + c, w);
}

float largest_weight(const Footprint& f) {
  const auto largest = [](const Taps& t) {
    return *std::max_element(t.weight.begin(), t.weight.begin() + t.count);
  };
  return largest(f.col) * largest(f.row);
}

/// Direct light; columns are projector pixels in tree order.
SparseColumns direct_columns(const PixelMap& map, std::span<const PixelLight> light,
                             std::span<const std::int32_t> camera, std::span<const std::int32_t> projector,
                             double sigma, double cutoff) {
  return gather(projector.size(), [&](auto take) {
    for (std::size_t pixel = 0; pixel < light.size(); ++pixel) {
      if (light[pixel].direct <= 0) continue;
      const Footprint f = footprint(map, pixel, sigma);
      const float least = static_cast<float>(cutoff) * largest_weight(f);
      float kept = 0;
      for_each_weight(f, least, [&](int, int, float w) { kept += w; });
      const float scale = static_cast<float>(light[pixel].direct) / kept;
      for_each_weight(f, least, [&](int row, int col, float w) {
        const auto raster = static_cast<std::size_t>(row) * static_cast<std::size_t>(map.projector.cols) +
                            static_cast<std::size_t>(col);
        take(static_cast<std::size_t>(projector[raster]), camera[pixel], w * scale);
      });
    }
  });
}

/// Near light; columns are the blocks of the surroundings, row by row.
SparseColumns near_columns(const PixelMap& map, std::span<const PixelLight> light,
                           std::span<const std::int32_t> camera, const Surroundings& surroundings,
                           std::size_t size) {
  const auto blocks =
      static_cast<std::size_t>(surroundings.rows()) * static_cast<std::size_t>(surroundings.cols());
  return gather(blocks, [&](auto take) {
    for (std::size_t pixel = 0; pixel < light.size(); ++pixel) {
      if (light[pixel].near[size] <= 0) continue;
      const Footprint f{surroundings.column_taps(static_cast<double>(map.col.values()[pixel])),
                        surroundings.row_taps(static_cast<double>(map.row.values()[pixel]))};
      for_each_weight(f, 1e-6F, [&](int row, int col, float w) {
        const float share = w / static_cast<float>(surroundings.block(row, col).size());
        take(surroundings.index(row, col), camera[pixel],
             share * static_cast<float>(light[pixel].near[size]));
      });
    }
  });
}

/// u 1ᵀ / |projector|
void add_far_light(TensorBuilder& builder, std::span<const PixelLight> light,
                   std::span<const std::int32_t> camera, std::size_t projector) {
  std::vector<float> factors(light.size() + projector, 1.0F / static_cast<float>(projector));
  for (std::size_t pixel = 0; pixel < light.size(); ++pixel)
    factors[camera[pixel]] = static_cast<float>(light[pixel].far);
  builder.add_leaf(0, static_cast<std::int32_t>(light.size()), 0, static_cast<std::int32_t>(projector), 1, 0,
                   factors);
}

void add_near_light(TensorBuilder& builder, const SparseColumns& columns, const Surroundings& surroundings) {
  for (int row = 0; row < surroundings.rows(); ++row) {
    for (int col = 0; col < surroundings.cols(); ++col) {
      const auto at = surroundings.index(row, col);
      const Block& block = surroundings.block(row, col);
      if (columns.count(at) > 0)
        builder.add_column(block.begin, block.end, columns.rows_of(at), columns.values_of(at));
    }
  }
}

void add_direct_light(TensorBuilder& builder, const SparseColumns& columns, std::size_t projector) {
  for (std::size_t at = 0; at < projector; ++at) {
    const auto begin = static_cast<std::int32_t>(at);
    if (columns.count(at) > 0)
      builder.add_column(begin, begin + 1, columns.rows_of(at), columns.values_of(at));
  }
}

/// T of fitted pixels. Direct light is one sparse column for each projector pixel. Near light is one column
/// for each block of each of the surroundings. Far light is one rank-1 leaf over everything. Footprint
/// weights below `cutoff` of the largest are dropped; the others are scaled to the sum 1.
TransportTensor light_tensor(const PixelMap& map, std::span<const PixelLight> light,
                             std::span<const Surroundings> surroundings, BlockTree projector, double sigma,
                             double cutoff) {
  const BlockTree camera(map.camera);
  const auto camera_index = tree_index(camera), projector_index = tree_index(projector);
  TensorBuilder builder(camera, std::move(projector), 1);
  add_far_light(builder, light, camera_index, projector_index.size());
  for (std::size_t z = 0; z < surroundings.size(); ++z)
    add_near_light(builder, near_columns(map, light, camera_index, surroundings[z], z), surroundings[z]);
  add_direct_light(builder, direct_columns(map, light, camera_index, projector_index, sigma, cutoff),
                   projector_index.size());
  return std::move(builder).finish();
}

}  // namespace
}  // namespace symrig::calibration

namespace symrig {
namespace {

using namespace calibration;

/// Lit pixels: white − black well above the noise.
std::vector<std::uint8_t> lit_pixels(const PixelMap& map, const DecodeOptions& options) {
  const double least = options.policy.contrast_sigmas * std::sqrt(2.0) * map.noise;
  std::vector<std::uint8_t> lit;
  lit.reserve(map.contrast.values().size());
  for (const float c : map.contrast.values()) lit.push_back(static_cast<double>(c) > least ? 1 : 0);
  return lit;
}

/// The map with positions in the holes, extended from the decoded pixels. The fit finds how much direct light
/// they have.
PixelMap without_holes(const PixelMap& map, const DecodeOptions& options) {
  Image<std::uint8_t> lit(map.camera);
  std::ranges::copy(lit_pixels(map, options), lit.values().begin());
  RawMap raw{{map.col, map.row}, map.mask};
  fill_holes(raw, lit);
  PixelMap filled = map;
  filled.col = std::move(raw.position[0]);
  filled.row = std::move(raw.position[1]);
  filled.mask = std::move(raw.mask);
  return filled;
}

Result<void> check(const FitOptions& options) {
  if (options.surroundings < 0)
    return Error{ErrorCode::bad_argument,
                 fmt::format("surroundings = {}; must not be below 0", options.surroundings)};
  if (!(options.weight_cutoff >= 0 && options.weight_cutoff < 1))
    return Error{ErrorCode::bad_argument,
                 fmt::format("weight_cutoff = {}; must be 0 or more and below 1", options.weight_cutoff)};
  return {};
}

/// The sizes of the surroundings that near light may come from [projector pixels]: translucent matter,
/// lenses, and the scene nearby. Or the given size.
std::array<int, kNearSizes> near_reaches(const FitOptions& options) {
  std::array<int, kNearSizes> sizes{4, 16, 64};
  if (options.surroundings > 0) sizes.fill(options.surroundings);
  return sizes;
}

std::vector<Surroundings> surroundings_of(const BlockTree& projector,
                                          const std::array<int, kNearSizes>& sizes) {
  std::vector<Surroundings> all;
  all.reserve(sizes.size());
  for (const int size : sizes) all.emplace_back(projector, size);
  return all;
}

/// See FitStatistics::surroundings.
int best_surroundings(const CodePhotographs& photographs, const FitOptions& options, const PixelMap& map,
                      const BlockTree& projector) {
  if (options.surroundings > 0) return options.surroundings;
  int best = 0;
  double least = 0;
  for (const int size : {16, 32, 64, 128}) {
    std::array<int, kNearSizes> sizes{};
    sizes.fill(size);
    const auto surroundings = surroundings_of(projector, sizes);
    const double left = LightModel(photographs, options.decode, surroundings).best_blur(map).squared_residual;
    if (best == 0 || left < least) best = size, least = left;
  }
  return best;
}

Image<float> black_level(Grid camera, const std::vector<PixelLight>& light) {
  Image<float> black(camera);
  std::ranges::transform(light, black.values().begin(),
                         [](const PixelLight& l) { return static_cast<float>(l.black); });
  return black;
}

/// rms over masked pixels; an empty mask means all.
double rms(std::span<const float> a, std::span<const float> b, std::span<const std::uint8_t> mask) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!mask.empty() && !mask[i]) continue;
    const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
    sum += d * d;
    count += 1;
  }
  return count == 0 ? 0 : std::sqrt(sum / count);
}

Result<void> predict_held_out(const CodePhotographs& photographs, const FitOptions& options,
                              FirstBounceFit& fit) {
  const auto lit = lit_pixels(fit.map, options.decode);
  const int pair = *options.decode.held_out_pair;
  for (int complement = 0; complement < 2; ++complement) {
    const int index = 2 * pair + complement;
    HeldOut held{photographs.code.pair(pair).name + (complement ? ", complement" : ""),
                 photographs.code.pattern(index), photographs.images[index]};
    std::ranges::transform(held.photograph.values(), fit.black.values(), held.photograph.values().begin(),
                           std::minus{});
    SYMRIG_TRY(const auto predicted, fit.tensor.apply(held.pattern));
    fit.errors.push_back({held.name,
                          rms(predicted.values(), held.photograph.values(), lit) / fit.statistics.mean_white,
                          rms(predicted.values(), held.photograph.values(), {}) / fit.statistics.mean_white});
    fit.held_out.push_back(std::move(held));
  }
  return {};
}

FitStatistics statistics_of(const CodePhotographs& photographs, const PixelMap& map,
                            const std::vector<PixelLight>& light, const FitOptions& options,
                            std::size_t seen) {
  const auto lit = lit_pixels(map, options.decode);
  FitStatistics s;
  double white = 0, direct = 0, near = 0, far = 0, residual = 0, count = 0;
  s.near_reaches = near_reaches(options);
  for (std::size_t i = 0; i < lit.size(); ++i) {
    if (!lit[i]) continue;
    white += static_cast<double>(photographs.white().values()[i]);
    direct += light[i].direct;
    near += std::accumulate(light[i].near.begin(), light[i].near.end(), 0.0);
    for (std::size_t z = 0; z < kNearSizes; ++z) s.near_shares[z] += light[i].near[z];
    far += light[i].far;
    residual += light[i].squared_residual;
    count += 1;
  }
  s.mean_white = white / count;
  s.lit_share = count / static_cast<double>(lit.size());
  s.decoded_share = map.decoded_share();
  s.direct_share = direct / (direct + near + far);
  s.near_share = near / (direct + near + far);
  for (double& share : s.near_shares) share /= direct + near + far;
  s.residual = std::sqrt(residual / (count * static_cast<double>(seen))) / s.mean_white;
  return s;
}

}  // namespace

Result<FirstBounceFit> fit_first_bounce(const CodePhotographs& photographs, const FitOptions& options) {
  SYMRIG_CHECK(check(options));
  SYMRIG_TRY(auto map, decode(photographs, options.decode));
  SYMRIG_CHECK(require_both_axes(map, "a first-bounce tensor"));
  if (options.decode.check_sequence) SYMRIG_CHECK(check_light(photographs, options.decode.held_out_pair));
  const BlockTree projector(map.projector);
  const auto surroundings = surroundings_of(projector, near_reaches(options));
  const LightModel model(photographs, options.decode, surroundings);
  const FittedBlur blur = model.best_blur(map);
  const PixelMap filled = without_holes(map, options.decode);
  const auto light = model.fit_all(filled, blur.sigma);
  FirstBounceFit fit{light_tensor(filled, light, surroundings, projector, blur.sigma, options.weight_cutoff),
                     black_level(map.camera, light),
                     std::move(map),
                     {},
                     {},
                     {}};
  fit.statistics = statistics_of(photographs, fit.map, light, options, model.photographs());
  fit.statistics.footprint_sigma = blur.sigma;
  fit.statistics.surroundings = best_surroundings(photographs, options, fit.map, projector);
  fit.statistics.scalars = static_cast<std::int64_t>(fit.tensor.column_rows().size());
  if (options.decode.held_out_pair) SYMRIG_CHECK(predict_held_out(photographs, options, fit));
  return fit;
}

Result<FirstBounceFit> fit_first_bounce(const std::filesystem::path& folder, const ReadCodeOptions& reading,
                                        const FitOptions& options) {
  SYMRIG_TRY(const auto photographs, read_gray_code_folder(folder, reading));
  return fit_first_bounce(photographs, options);
}

}  // namespace symrig
