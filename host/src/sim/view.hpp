// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/outline.hpp"
#include "symrig/sim/scene.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace symrig::sim {

/// The depth of the scene at a point of the cells, from −½ (nearest) to ½ (farthest). It is continuous.
using Depth = double (*)(Grid cells, Point at);

/// Where each point of the camera's picture looks. It is exact: the tests of a registration compare with it.
///
/// With x the point from the middle of the picture in cells at zoom 1:
///   q = middle + shift + moved + R(turn) x (1 + distortion |x|² / h²) / zoom · (1 + colour_c / h)
/// h: half diagonal of the cells. The point that is seen is p with p + (0, parallax · depth(p)) = q.
class BenchMap {
 public:
  BenchMap(const SceneUri& uri, Depth depth);

  Grid camera() const { return camera_; }
  /// Camera pixels along the side of a cell, in the middle.
  double pixels_per_cell() const { return zoom_ / cells_per_pixel_; }
  /// The point of the cells that a point of the camera's picture sees. moved: shift of the camera along both
  /// axes [cells].
  Point look(Point camera, int channel, double moved) const;

 private:
  Point seen_at(Point q) const;

  Grid cells_, camera_;
  Depth depth_;
  double cells_per_pixel_, half_diagonal_;
  double cos_, sin_, zoom_, distortion_, parallax_;
  Offset shift_;
  std::array<double, 3> magnify_{1, 1, 1};
};

/// What the camera sees of the light that the projector sends, without noise. Linear in the light.
/// Thread-safe.
class CameraView {
 public:
  CameraView() = default;
  CameraView(const CameraView&) = delete;
  CameraView& operator=(const CameraView&) = delete;
  virtual ~CameraView() = default;

  /// The camera's grid.
  virtual Grid camera() const = 0;
  virtual int channels() const = 0;
  /// light: on the projector's cells, one channel. shown_before: number of patterns shown before, for a rig
  /// that moves. Result: radiance on the camera's grid.
  virtual Image<float> see(const Image<float>& light, std::uint64_t shown_before) const = 0;
  /// Where the corners of the camera's pixels look at the start; as VirtualRig::exact_corners().
  virtual std::vector<CornerMap> corners() const { return {}; }
  /// What CellWeights::make calls shares, exactly: the light of the flood-lit scene that a pixel gets from
  /// the first row and column of the cells that it sees; mean of the channels that share a map. Empty: no own
  /// pixels.
  virtual Image<float> flood_shares() const { return {}; }
  /// Vignetting: the camera's on its own grid, the projector's on the cells.
  virtual Image<float> camera_gain() const { return {}; }
  virtual Image<float> projector_gain() const { return {}; }
  /// True if the view changes while patterns are shown.
  virtual bool moves() const { return false; }
};

/// True if the scene's keys describe another bench than a coaxial one with shared cells.
bool is_bench(const SceneUri& uri);

/// A simulated bench.
struct Bench {
  std::shared_ptr<const Scene> truth;  ///< make_scene(): T of the ideal coaxial rig
  std::unique_ptr<const CameraView> view;
};
/// fails: as make_scene.
Result<Bench> make_bench(const SceneUri& uri);

/// A bench with the optics that the scene's keys describe. points: the scene's fine points.
///
///   see = C A G_c S G_p P U light
///
/// U: the light of a cell falls on all of its points. P, C: vignetting. G_p, G_c: defocus of projector and
/// camera. S: the scene. A: each camera pixel averages the points inside its outline (BenchMap), and
/// those inside the outline of its ghost. Points outside the picture are dark.
std::unique_ptr<const CameraView> bench_view(const SceneUri& uri, std::shared_ptr<const Scene> points);

}  // namespace symrig::sim
