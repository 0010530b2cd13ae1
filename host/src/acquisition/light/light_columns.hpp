// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_series.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace symrig::acquisition {

/// A column holds the light of a way's pixel if it has this share of the most that this pixel ever has.
inline constexpr double kOwnLight = 0.5;
/// Light that goes one way: that back is less than this share.
inline constexpr double kNotBack = 0.25;

/// In which way a camera may see the pixels: photograph k shows pixel k - late, turned and moved.
struct ColumnWay {
  LightOrder order;
  int down = 0, right = 0;  ///< the camera looks this far beside

  bool own() const { return order.right() && down == 0 && right == 0; }
};

/// T by its columns, all channels added; pixels in tree order.
class LightColumns {
 public:
  explicit LightColumns(const TransportTensor& measured);

  std::size_t size() const { return most_.size(); }
  Grid grid() const { return grid_; }
  /// Light of camera pixel `row` in photograph `col`; 0 if it was not above its noise.
  double light(std::size_t row, std::size_t col) const;
  /// Of a pixel in all photographs.
  double most(std::size_t row) const { return most_[row]; }
  double least(std::size_t row) const { return least_[row]; }
  /// Photographs that hold light of the pixel.
  std::size_t entries(std::size_t row) const { return entries_[row]; }
  /// Photographs with strong light to which no light back belongs.
  std::size_t photographs_of_one_way() const;
  /// The pixel reflects enough light to tell something.
  bool lit(std::size_t row) const { return most_[row] > lit_ && lit_ > 0; }

  /// Row and column of a pixel, and back.
  std::array<int, 2> place(std::size_t pixel) const {
    const int raster = tensor_.camera_tree().order()[pixel];
    return {raster / grid_.cols, raster % grid_.cols};
  }
  std::size_t pixel(int row, int col) const {
    return pixels_[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.cols) +
                   static_cast<std::size_t>(col)];
  }
  /// The camera pixel that holds the light of photograph `col`; none: outside.
  std::optional<std::size_t> seen_at(const ColumnWay& way, std::size_t col) const;
  /// Whether photograph `col` holds the light of a way's pixel; none: nothing is known of this pixel.
  std::optional<bool> follows(const ColumnWay& way, std::size_t col) const {
    const auto row = seen_at(way, col);
    if (!row || !lit(*row)) return std::nullopt;
    return light(*row, col) > kOwnLight * most(*row);
  }
  std::string name(std::size_t pixel) const {
    const auto [row, col] = place(pixel);
    return fmt::format("row {}, column {}", row, col);
  }

 private:
  static constexpr double kOfBright = 0.05, kBright = 0.9;

  double value(std::int64_t entry) const;

  const TransportTensor& tensor_;
  Grid grid_;
  std::vector<std::size_t> pixels_;  // in tree order, of places in raster order
  std::vector<double> most_, least_;
  std::vector<std::size_t> entries_;
  double lit_ = 0;
};

}  // namespace symrig::acquisition
