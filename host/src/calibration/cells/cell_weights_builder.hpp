// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/cells/shared_pixels.hpp"
#include "symrig/calibration/cell_weights.hpp"
#include "symrig/image/outline.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::calibration {

/// A camera pixel and a cell that it overlaps.
struct CellOverlap {
  std::uint32_t cell, pixel;
  float area;
  bool core;
  float row, col;             ///< the middle of the overlap, from the middle of the cell
  float whole;                ///< area of the pixel, inside and outside of the cells
  bool first_row, first_col;  ///< of the cells that the pixel sees
  bool two;                   ///< it sees at most two rows and two columns
  double share() const { return static_cast<double>(area / whole); }  ///< of the pixel
};

/// All overlaps, ordered by cell, then by pixel. corners: of the camera's pixels, on the cells. margin: of a
/// core from the border of its cell [cells].
std::vector<CellOverlap> cell_overlaps(Grid cells, const CornerMap& corners, double margin);

/// How much of a pixel belongs to a cell: by its light if the shares are known, else by its area.
class LightParts {
 public:
  /// shares: as for CellWeights::make(), or none. map: index of the corner map.
  LightParts(const Image<float>* shares, std::size_t map) {
    if (shares == nullptr) return;
    row_ = shares->plane(2 * static_cast<int>(map));
    col_ = shares->plane(2 * static_cast<int>(map) + 1);
  }

  double area(const CellOverlap& p) const {
    if (row_.empty() || !p.two) return static_cast<double>(p.area);
    const auto row = static_cast<double>(row_[p.pixel]), col = static_cast<double>(col_[p.pixel]);
    if (row < 0 || col < 0) return static_cast<double>(p.area);
    return static_cast<double>(p.whole) * (p.first_row ? row : 1 - row) * (p.first_col ? col : 1 - col);
  }

 private:
  std::span<const float> row_, col_;
};

}  // namespace symrig::calibration

namespace symrig {

/// Builds the weights of one corner map, then of the channels that use it.
class CellWeightsBuilder {
 public:
  CellWeightsBuilder(Grid cells, const WeightOptions& options) : cells_(cells), options_(options) {}

  using Part = calibration::CellOverlap;
  using LightParts = calibration::LightParts;
  using SharedPixels = calibration::SharedPixels;

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

}  // namespace symrig
