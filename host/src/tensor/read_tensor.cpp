// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/internal/half.hpp"
#include "tensor/leaf_file.hpp"
#include "tensor/scene_file.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace symrig::tensor {

Result<std::int32_t> read_count(const Object& file, const char* attribute, const std::string& groups) {
  SYMRIG_TRY(const auto count, h5::read_integers(file, attribute, 1));
  if (count[0] < 0) return damaged("attribute '" + std::string(attribute) + "' is negative");
  const std::string next = groups + "/" + std::to_string(count[0]);
  SYMRIG_TRY(const bool is_more, h5::exists(file, next));
  if (is_more)
    return damaged("there is a group '" + next + "', but '" + attribute + "' is " + std::to_string(count[0]));
  return count[0];
}

namespace {

using tensor::Half;

/// The floats of the dataset `name`. Version 1 stores floats; version 2 stores halves, here without their
/// exponents.
Result<std::vector<float>> read_halves(const Object& file, const Head& head, const std::string& name,
                                       std::size_t rank, h5::Shape& shape) {
  std::vector<float> values;
  if (head.version == 1) {
    SYMRIG_TRY(values, h5::read_dataset<float>(file, name, rank, shape));
  } else {
    SYMRIG_TRY(const auto halves, h5::read_dataset<Half>(file, name, rank, shape));
    values.resize(halves.size());
    std::transform(halves.begin(), halves.end(), values.begin(), tensor::from_half);
  }
  if (!all_finite(values))
    return impossible("dataset '" + name + "' has a value that is not a finite number");
  return values;
}

/// values · 2^exponent, exactly. False if the result is not finite or the exponent is out of a float's range.
bool scale(std::span<float> values, std::int32_t exponent) {
  if (exponent < -200 || exponent > 200) return false;
  for (float& v : values) v = std::ldexp(v, exponent);
  return all_finite(values);
}

/// Leaves of version 1: floats.
Result<void> read_float_leaves(const Object& file, const Head& head, const Trees& trees,
                               TensorBuilder& builder) {
  SYMRIG_TRY(const std::vector<Leaf> leaves, read_leaf_list(file, head, trees));
  h5::Shape s;
  SYMRIG_TRY(const std::vector<float> values, read_halves(file, head, "leaves/factors", 1, s));
  std::span<const float> left = values;
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    const Leaf& leaf = leaves[k];
    const auto factors = left.first(leaf.values(head.channels));
    if (!leaf_values_ok(factors, leaf, head)) return breaks_rules(k);
    builder.add_leaf(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.rank, leaf.level,
                     factors);
    left = left.subspan(factors.size());
  }
  return {};
}

/// Leaves of version 2, in memory or left in their file.
Result<void> read_leaves(const Object& file, const Head& head, const Trees& trees, const KeepLeaves& keep,
                         TensorBuilder& builder) {
  if (head.version == 1) return read_float_leaves(file, head, trees, builder);
  SYMRIG_TRY(std::vector<Leaf> leaves, read_leaf_list(file, head, trees));
  const LowRank::Shape shape{head.camera.size(), head.projector.size(), head.symmetric, head.channels};
  const PartRange all = parts_of(leaves, head.channels).back();
  const auto bytes = static_cast<std::int64_t>((all.first_value + all.values) * sizeof(Half));
  if (bytes > keep.bytes) {
    const auto open = std::make_shared<const LeafFile>(file, keep.path.string(), head);
    const auto read = [open](const PartRange& part, std::span<const Leaf> of_part, PartValues& to) {
      return open->read(part, of_part, to);
    };
    LeafParts parts(leaves, read, shape);
    builder.take_leaves(std::move(leaves), std::move(parts));
    return {};
  }
  const LeafReader reader(file, head);
  const auto read = [&](const PartRange& part, std::span<const Leaf> of_part, PartValues& to) {
    return reader.read(part, of_part, to);
  };
  SYMRIG_TRY(LeafParts parts, LeafParts::kept(leaves, read, shape));
  builder.take_leaves(std::move(leaves), std::move(parts));
  return {};
}

Result<void> read_empties(const Object& file, const Trees& trees, TensorBuilder& builder) {
  h5::Shape s;
  SYMRIG_TRY(const auto rows, h5::read_dataset<std::int32_t>(file, "leaves/empty", 2, s));
  if (s[1] != 3) return damaged("dataset 'leaves/empty' does not have three columns");
  for (std::size_t k = 0; k < s[0]; ++k) {
    const std::int32_t level = rows[3 * k], row = rows[3 * k + 1], col = rows[3 * k + 2];
    const bool ok = level >= 0 && level < trees.levels() && row >= 0 &&
                    row < Trees::blocks(*trees.camera, level) && col >= 0 &&
                    col < Trees::blocks(*trees.projector, level);
    if (!ok) return damaged("empty leaf " + std::to_string(k) + " names blocks that do not exist");
    builder.add_empty(level, row, col);
  }
  return {};
}

/// Reads single entries. Version 1 stores the channels of an entry together, version 2 stores them in planes.
Result<void> read_scalars(const Object& file, const Head& head, TensorBuilder& builder) {
  h5::Shape s;
  SYMRIG_TRY(const auto at, h5::read_dataset<std::int32_t>(file, "scalars/at", 2, s));
  const std::size_t n = s[0];
  if (s[1] != 2) return damaged("dataset 'scalars/at' does not have two columns");
  SYMRIG_TRY(std::vector<float> values, read_halves(file, head, "scalars/values", 2, s));
  const std::size_t channels = head.channels;
  const h5::Shape expected = head.version == 1 ? h5::Shape{n, channels} : h5::Shape{channels, n};
  if (s != expected) return damaged("dataset 'scalars/values' does not fit 'scalars/at'");
  if (head.version > 1) {
    SYMRIG_TRY(const auto exponents, h5::read_dataset<std::int32_t>(file, "scalars/exponents", 1, s));
    for (std::size_t c = 0; c < channels; ++c)
      if (exponents.size() != channels || !scale(std::span(values).subspan(c * n, n), exponents[c]))
        return damaged("dataset 'scalars/exponents' breaks the rules of the format");
  }
  SYMRIG_CHECK(check_values(values, "dataset 'scalars/values'", kLargest));
  std::vector<float> of_scalar(channels);
  for (std::size_t k = 0; k < n; ++k) {
    const std::int32_t row = at[2 * k], col = at[2 * k + 1];
    if (row < 0 || row >= head.camera.size() || col < 0 || col >= head.projector.size())
      return damaged("scalar " + std::to_string(k) + " points outside the grid");
    for (std::size_t c = 0; c < channels; ++c)
      of_scalar[c] = values[head.version == 1 ? k * channels + c : c * n + k];
    builder.add_scalar(row, col, of_scalar);
  }
  return {};
}

Result<void> read_diagonal(const Object& file, const Head& head, TensorBuilder& builder) {
  h5::Shape s;
  SYMRIG_TRY(const auto at, h5::read_dataset<std::int32_t>(file, "diagonal/at", 1, s));
  SYMRIG_TRY(const auto values, h5::read_dataset<float>(file, "diagonal/values", 2, s));
  const std::size_t channels = head.channels;
  if (s != h5::Shape{at.size(), channels} || (!head.symmetric && !at.empty()))
    return damaged("the datasets in 'diagonal' do not fit together");
  SYMRIG_CHECK(check_values(values, "dataset 'diagonal/values'", kLargest));
  std::vector<bool> seen(head.camera.size());
  for (std::size_t k = 0; k < at.size(); ++k) {
    if (at[k] < 0 || at[k] >= head.camera.size())
      return damaged("diagonal entry " + std::to_string(k) + " points outside the grid");
    if (seen[at[k]]) return damaged("dataset 'diagonal/at' names pixel " + std::to_string(at[k]) + " twice");
    seen[at[k]] = true;
    builder.add_scalar(at[k], at[k], std::span(values).subspan(k * channels, channels));
  }
  return {};
}

Result<void> read_columns(const Object& file, const Head& head, TensorBuilder& builder) {
  h5::Shape s;
  SYMRIG_TRY(const auto range, h5::read_dataset<std::int32_t>(file, "columns/range", 2, s));
  const std::size_t n = s[0];
  if (s[1] != 2) return damaged("dataset 'columns/range' does not have two columns");
  SYMRIG_TRY(const auto first, h5::read_dataset<std::int64_t>(file, "columns/first", 1, s));
  SYMRIG_TRY(const auto rows, h5::read_dataset<std::int32_t>(file, "columns/rows", 1, s));
  SYMRIG_TRY(const auto values, h5::read_dataset<float>(file, "columns/values", 2, s));
  const std::size_t channels = head.channels;
  const bool fit = first.size() == n + 1 && first.front() == 0 && first.back() == std::ssize(rows) &&
                   s[0] == rows.size() && s[1] == channels;
  if (!fit || (head.symmetric && n > 0)) return damaged("the datasets in 'columns' do not fit together");
  SYMRIG_CHECK(check_values(values, "dataset 'columns/values'", kLargest));
  for (const std::int32_t row : rows)
    if (row < 0 || row >= head.camera.size())
      return damaged("dataset 'columns/rows' points outside the grid");
  for (std::size_t k = 0; k < n; ++k) {
    const bool ok = range_ok(range[2 * k], range[2 * k + 1], head.projector.size()) &&
                    first[k] <= first[k + 1] && first[k + 1] <= std::ssize(rows);
    if (!ok) return damaged("column " + std::to_string(k) + " in 'columns' breaks the rules of the format");
    const std::size_t begin = first[k];
    const std::size_t size = first[k + 1] - first[k];
    builder.add_column(range[2 * k], range[2 * k + 1], std::span(rows).subspan(begin, size),
                       std::span(values).subspan(begin * channels, size * channels));
  }
  return {};
}

/// True if the values of neighbours outside of the grid are 0.
bool stays_on_grid(std::span<const float> plane, Grid grid, BandOffset d) {
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      if (row + d.dy >= grid.rows || col + d.dx < 0 || col + d.dx >= grid.cols)
        if (plane[static_cast<std::size_t>(row) * grid.cols + col] != 0.0F) return false;
  return true;
}

Result<void> read_band(const Object& file, const Head& head, const std::string& path,
                       TensorBuilder& builder) {
  SYMRIG_TRY(const Object group, h5::open_group(file, path));
  SYMRIG_TRY(const auto radius, h5::read_integers(group, "radius", 1));
  if (!head.symmetric || radius[0] < 1 || radius[0] > 1024)
    return damaged("'" + path + "' has no valid radius");
  const std::vector<BandOffset> offsets = band_offsets(radius[0]);
  h5::Shape s, e;
  SYMRIG_TRY(std::vector<float> values, read_halves(file, head, path + "/values", 4, s));
  SYMRIG_TRY(const auto exponents, h5::read_dataset<std::int32_t>(group, "exponents", 2, e));
  const auto channels = static_cast<std::uint64_t>(head.channels);
  if (s != h5::Shape{channels, offsets.size(), std::uint64_t(head.camera.rows),
                     std::uint64_t(head.camera.cols)} ||
      e != h5::Shape{channels, offsets.size()})
    return damaged("the datasets in '" + path + "' do not fit together");
  const std::size_t pixels = head.camera.size();
  for (std::size_t k = 0; k < exponents.size(); ++k) {
    const auto plane = std::span(values).subspan(k * pixels, pixels);
    if (!scale(plane, exponents[k]) || !stays_on_grid(plane, head.camera, offsets[k % offsets.size()]))
      return damaged("'" + path + "' breaks the rules of the format");
  }
  SYMRIG_CHECK(check_values(values, "'" + path + "/values'", kLargest));
  builder.add_band(radius[0], values);
  return {};
}

Result<void> read_bands(const Object& file, const Head& head, TensorBuilder& builder) {
  SYMRIG_TRY(const std::int32_t count, read_count(file, "band_count", "bands"));
  for (std::int32_t k = 0; k < count; ++k)
    SYMRIG_CHECK(read_band(file, head, "bands/" + std::to_string(k), builder));
  return {};
}

}  // namespace

Result<void> read_tensor(const Object& file, const Head& head, const BlockTree& camera,
                         const BlockTree& projector, const KeepLeaves& keep, TensorBuilder& builder) {
  const Trees trees{&camera, &projector};
  SYMRIG_CHECK(read_leaves(file, head, trees, keep, builder));
  SYMRIG_CHECK(read_empties(file, trees, builder));
  SYMRIG_CHECK(read_scalars(file, head, builder));
  SYMRIG_CHECK(read_columns(file, head, builder));
  if (head.version == 1) return {};
  SYMRIG_CHECK(read_diagonal(file, head, builder));
  return read_bands(file, head, builder);
}

}  // namespace symrig::tensor
