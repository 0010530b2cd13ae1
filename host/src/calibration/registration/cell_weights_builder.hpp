// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/registration/cell_overlaps.hpp"
#include "calibration/registration/shared_pixels.hpp"
#include "symrig/calibration/cell_weights.hpp"

#include <cstdint>
#include <span>
#include <vector>

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
