// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/hdr/mosaic.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace symrig::tests {

inline constexpr BayerPattern kRggb{};

/// The light of the three colours, relative to that of the scene.
using Tint = std::array<float, 3>;

/// A camera that sees three colours, behind the filters of a mosaic.
class FilteredProbe final : public Probe {
 public:
  explicit FilteredProbe(std::unique_ptr<VirtualRig> rig, const Tint& tint = {1, 1, 1})
      : rig_(std::move(rig)), tint_(tint) {}
  Grid grid() const override { return rig_->grid(); }
  Grid camera_grid() const override { return rig_->camera_grid(); }
  int channels() const override { return 1; }
  ProbeCost cost() const override { return rig_->cost(); }
  std::string describe() const override { return rig_->describe(); }
  bool plans_exposures(std::size_t photographs) const override { return rig_->plans_exposures(photographs); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    return filtered(rig_->measure(patterns));
  }
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) override {
    return filtered(rig_->measure_expected(patterns, expected));
  }

 private:
  Result<std::vector<Radiance>> filtered(Result<std::vector<Radiance>> photographs) const {
    if (!photographs) return photographs;
    for (Radiance& one : *photographs) {
      const Grid grid = one.mean.grid();
      Radiance mosaic{Image<float>(grid), Image<float>(grid), Image<std::uint8_t>(grid)};
      for (int row = 0; row < grid.rows; ++row)
        for (int col = 0; col < grid.cols; ++col) {
          const int own = kRggb.at(row, col);
          const float tint = tint_.at(static_cast<std::size_t>(own));
          mosaic.mean.at(row, col) = tint * one.mean.at(row, col, own);
          mosaic.variance.at(row, col) = tint * tint * one.variance.at(row, col, own);
          mosaic.valid.at(row, col) = one.valid.at(row, col, own);
        }
      one = std::move(mosaic);
    }
    return photographs;
  }

  std::unique_ptr<VirtualRig> rig_;
  Tint tint_;
};

}  // namespace symrig::tests
