// SPDX-License-Identifier: Apache-2.0
// Tensors with every kind of leaf, and the matrix they stand for.
#pragma once

#include "symrig/base/statistics.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig::tests {

/// A tensor next to the dense matrix it must equal: matrix[row * cols + col] in tree order, and Σ|A||B|ᵀ for
/// rounding bounds.
struct TensorAndMatrix {
  TransportTensor tensor;
  std::vector<double> matrix, magnitude;
  std::size_t cols = 0;
  int longest = 0;  ///< largest |J| of any leaf
};

class RandomTensor {
 public:
  RandomTensor(Grid camera, Grid projector, bool symmetric, int channels, std::uint64_t seed,
               double lowest = -0.5)
      : symmetric_(symmetric),
        channels_(channels),
        lowest_(lowest),
        random_(seed),
        camera_(camera),
        projector_(symmetric ? camera : projector),
        builder_(symmetric ? TensorBuilder(camera_, channels)
                           : TensorBuilder(camera_, projector_, channels)) {
    made_.cols = static_cast<std::size_t>(projector_.grid().size());
    made_.matrix.resize(static_cast<std::size_t>(camera_.grid().size()) * made_.cols);
    made_.magnitude.resize(made_.matrix.size());
  }

  /// One low-rank leaf for each pair of blocks of `level` that a coin picks, then `scalars` single entries.
  TensorAndMatrix make(int level, int rank, int scalars) {
    const int row_level = std::min(level, camera_.levels() - 1);
    const int col_level = std::min(level, projector_.levels() - 1);
    const auto rows = camera_.level(row_level);
    const auto cols = projector_.level(col_level);
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (std::size_t j = 0; j < (symmetric_ ? i + 1 : cols.size()); ++j)
        if (random_.uniform() < 0.6) add_leaf(rows[i], cols[j], rank, level);
    for (int k = 0; k < scalars; ++k) add_scalar();
    made_.tensor = std::move(builder_).finish();
    return std::move(made_);
  }

  /// Adds a band of radius 1 (not to the matrix).
  RandomTensor& with_band(bool wanted) {
    const Grid grid = camera_.grid();
    std::vector<float> planes;
    for (int channel = 0; wanted && channel < channels_; ++channel)
      for (const auto& [dy, dx] : band_offsets(1))
        for (int row = 0; row < grid.rows; ++row)
          for (int col = 0; col < grid.cols; ++col)
            planes.push_back(row + dy < grid.rows && col + dx >= 0 && col + dx < grid.cols ? value() : 0.0F);
    if (wanted) builder_.add_band(1, planes);
    return *this;
  }

 private:
  float value() { return static_cast<float>(lowest_ + random_.uniform() * (1.5 - lowest_)); }

  void note(std::int32_t row, std::int32_t col, double v, double size) {
    made_.matrix[static_cast<std::size_t>(row) * made_.cols + static_cast<std::size_t>(col)] += v;
    made_.magnitude[static_cast<std::size_t>(row) * made_.cols + static_cast<std::size_t>(col)] += size;
  }

  void add_leaf(const Block& i, const Block& j, int max_rank, int level) {
    const bool diagonal = symmetric_ && i.begin == j.begin;
    const int rank = std::min({max_rank, i.size(), j.size()});
    std::vector<float> factors;
    for (int channel = 0; channel < channels_; ++channel) {
      std::vector<float> a, b;
      for (int k = 0; k < rank * i.size(); ++k) a.push_back(value());
      for (int k = 0; k < rank * j.size(); ++k) b.push_back(value());
      if (diagonal) b = a;
      factors.insert(factors.end(), a.begin(), a.end());
      factors.insert(factors.end(), b.begin(), b.end());
      if (channel != 0) continue;
      made_.longest = std::max({made_.longest, i.size(), j.size()});
      for (int x = 0; x < i.size(); ++x) {
        for (int y = 0; y < j.size(); ++y) {
          double sum = 0, size = 0;
          for (int k = 0; k < rank; ++k) {
            const double product = double{a[k * i.size() + x]} * double{b[k * j.size() + y]};
            sum += product;
            size += std::abs(product);
          }
          note(i.begin + x, j.begin + y, sum, size);
          if (symmetric_ && !diagonal) note(j.begin + y, i.begin + x, sum, size);
        }
      }
    }
    builder_.add_leaf(i.begin, i.end, j.begin, j.end, rank, level, factors);
  }

  void add_scalar() {
    auto row = static_cast<std::int32_t>(random_.uniform() * static_cast<double>(camera_.grid().size()));
    auto col = static_cast<std::int32_t>(random_.uniform() * static_cast<double>(projector_.grid().size()));
    if (symmetric_ && row < col) std::swap(row, col);
    std::vector<float> values(channels_);
    for (float& v : values) v = value();
    builder_.add_scalar(row, col, values);
    note(row, col, values[0], std::abs(values[0]));
    // The mirror image.
    if (symmetric_ && row != col)
      note(col, row, values[0], std::abs(values[0]));  // NOLINT(readability-suspicious-call-argument)
  }

  bool symmetric_;
  int channels_;
  double lowest_;
  Random random_;
  BlockTree camera_, projector_;
  TensorBuilder builder_;
  TensorAndMatrix made_;
};

}  // namespace symrig::tests
