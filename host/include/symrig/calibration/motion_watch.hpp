// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"
#include "symrig/camera/mosaic.hpp"
#include "symrig/image/outline.hpp"

#include <array>
#include <span>
#include <utility>

namespace symrig {

/// How far the camera's picture of the cells is from where it was.
struct Motion {
  double row = 0, col = 0;  ///< [cells]
  double sigma = 0;         ///< standard deviation of each, by the photographs' noise [cells]
  double brightness = 1;    ///< lamp and exposure, relative to then

  double distance() const;
};

/// Notices that a registered rig has moved. It compares photographs of two stripe patterns with those of the
/// registration: a picture that moved by d changed by d · ∇ of the picture. Edges of stripes are sharper than
/// the camera's pixels, so the distance is right within a third; 0 is exact.
class MotionWatch {
 public:
  /// Stripes two cells wide, then the same across.
  static std::array<Pattern, 2> patterns(Grid cells);

  /// before: means of the photographs of both patterns, one after the other: 2 · channels planes.
  /// step: CameraMap::step(). mosaic: the camera's colour filters. Pixels of one colour are two pixels apart.
  MotionWatch(Grid cells, Image<float> before, std::array<Point, 2> step, Mosaic mosaic = Mosaic::none)
      : cells_(cells), before_(std::move(before)), step_(step), mosaic_(mosaic) {}

  /// Takes two photographs.
  /// fails: as the rig; size_mismatch; bad_value (the pictures have no edges).
  Result<Motion> measure(Probe& rig) const;
  /// now: photographs of patterns().
  /// fails: as measure(), without the rig.
  Result<Motion> compare(std::span<const Radiance> now) const;
  Mosaic mosaic() const { return mosaic_; }

 private:
  Grid cells_;
  Image<float> before_;
  std::array<Point, 2> step_;
  Mosaic mosaic_;
};

}  // namespace symrig
