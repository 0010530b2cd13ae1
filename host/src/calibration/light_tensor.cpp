// SPDX-License-Identifier: Apache-2.0
#include "calibration/light_tensor.hpp"

#include <algorithm>
#include <numeric>

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

}  // namespace

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

}  // namespace symrig::calibration
