// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace symrig::viewer {

/// A leaf of the page. In a symmetric tensor a mirrored leaf stands for its mirror image too.
struct PageLeaf {
  std::int32_t row_begin = 0, row_end = 0, col_begin = 0, col_end = 0, rank = 0, level = 0, mirrored = 0;

  std::int32_t rows() const { return row_end - row_begin; }
  std::int32_t cols() const { return col_end - col_begin; }
};

/// The pixels of one side, camera or projector.
struct PageSide {
  Grid grid;
  std::vector<std::int32_t> order;  ///< [tree index] = raster index
  /// How many pixels of the scene a pixel of the page holds; tree order. Empty: one.
  std::vector<float> areas;

  std::int64_t pixels() const { return static_cast<std::int64_t>(order.size()); }
};

/// A tensor in the form in which the page holds it: plain lists, no index. T is the sum of its parts. The
/// photograph is T · pattern, divided by the areas of the camera's pixels.
struct PageTensor {
  PageSide camera, projector;  ///< equal if symmetric
  int channels = 1;
  bool symmetric = true;
  std::vector<PageLeaf> leaves;
  std::vector<float> factors;       ///< as TransportTensor::factors()
  std::vector<float> diagonal;      ///< [channel][pixel], symmetric tensors only; may be empty
  std::vector<ScalarLeaf> entries;  ///< sorted by row, then column; row > col if symmetric
  std::vector<float> entry_values;  ///< [entry * channels + channel]
  std::vector<BandLeaf> bands;
  std::vector<SparseColumn> columns;
  std::vector<std::int32_t> column_rows;
  std::vector<float> column_values;  ///< [entry * channels + channel]
};

PageLeaf page_leaf(const Leaf& leaf, bool symmetric);
/// fails: as TransportTensor::factors.
Result<PageTensor> page_tensor(const TransportTensor& tensor);

/// The same at about half the rows and columns: each block of the last level but one becomes one pixel. Its
/// light goes to all its pixels, and its photograph is their mean. `levels`: how often to do it, ≥ 1.
/// fails: limit (several views, measured columns, or no such level left).
Result<PageTensor> reduced_tensor(const TransportTensor& tensor, int levels);

/// Collects single entries of T in any order, and adds up those of one place. In a symmetric tensor an entry
/// off the diagonal also stands for its mirror image, and the diagonal is kept apart.
class EntrySums {
 public:
  explicit EntrySums(PageTensor& page) : page_(page) {}

  /// T[row, col] += values[channel]; its mirror image too if row ≠ col and the tensor is symmetric.
  void add(std::int32_t row, std::int32_t col, std::span<const float> values);
  /// values: [entry * channels + channel].
  void add(std::span<const ScalarLeaf> at, std::span<const float> values);
  /// Sorts the entries into the page.
  void finish();

 private:
  struct Entry {
    std::int32_t row, col;
    std::array<float, 3> values;  // a tensor has at most 3 channels
  };
  void add_to_diagonal(std::int32_t pixel, std::span<const float> values);

  PageTensor& page_;
  std::vector<Entry> entries_;
};

}  // namespace symrig::viewer
