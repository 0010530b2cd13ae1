// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/registration/ghost_subtraction.hpp"
#include "calibration/registration/own_views.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/calibration/registration.hpp"

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig::calibration {

/// One view of a rig of several, as a rig of its own: patterns are on the cells of its tile. Only the pixels
/// that belong to the view are valid in photographs, because others see the same points from elsewhere.
class OneView final : public Probe {
 public:
  /// rig, own: must outlive this.
  OneView(Probe& rig, const OwnViews& own, View view)
      : rig_(rig), own_(own), view_(view), tile_(rig.views().tile(rig.grid(), view)) {}

  Grid grid() const override { return tile_.grid; }
  Grid camera_grid() const override { return rig_.camera_grid(); }
  int channels() const override { return rig_.channels(); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override;
  ProbeCost cost() const override { return rig_.cost(); }
  std::string describe() const override { return rig_.describe(); }

  /// From now on, photographs have no ghost. It is subtracted before pixels become invalid, because the ghost
  /// of a pixel near the border of a view comes from pixels of another one.
  void subtract(GhostSubtraction ghost) { ghost_ = std::move(ghost); }
  /// The registration of this view: the maps of `whole` on the cells of the tile, and no ghost.
  /// lit: photograph of the view, lit whole and alone, with its ghost.
  Registration part_of(const Registration& whole, const Radiance& lit) const;

 private:
  Radiance of_view(Radiance photograph) const;

  Probe& rig_;
  const OwnViews& own_;
  View view_;
  Tile tile_;
  std::optional<GhostSubtraction> ghost_;
};

}  // namespace symrig::calibration
