// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/light/exchange.hpp"
#include "sim/light/transport.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace symrig::sim {

/// M: the scene points that a pixel of the rig sees, with their weights. The projector lights the same points
/// with the same weights, so T = M S Mᵀ is symmetric. A sparse matrix [rig pixels × scene points], weights ≥
/// 0, rows added in order.
class Optics {
 public:
  explicit Optics(std::size_t scene_points) : scene_points_(scene_points) {}

  /// The current pixel also sees `point` with this weight.
  void add(std::int64_t point, float weight);
  void end_pixel() { end_.push_back(point_.size()); }

  std::size_t pixels() const { return end_.size(); }
  std::size_t scene_points() const { return scene_points_; }
  /// seen = M scene.
  void see(std::span<const float> scene, std::span<float> seen) const;
  /// lit = Mᵀ light.
  void light(std::span<const float> light, std::span<float> lit) const;
  /// lit += Mᵀ light.
  void add_light(std::span<const float> light, std::span<float> lit) const;

 private:
  std::size_t scene_points_;
  std::vector<std::size_t> end_;
  std::vector<std::uint32_t> point_;
  std::vector<float> weight_;
};

/// M S Mᵀ.
std::unique_ptr<Transport> seen_through(std::shared_ptr<const Optics> optics,
                                        std::unique_ptr<Transport> scene);

/// A concave, slightly wavy mirror with an elliptic outline in the right plane of a groove. Its middle is at
/// 73 % of the width and 58 % of the height. A pixel on it sees, and lights, the points of the left plane
/// where its four reflected rays land. Rays that miss the plane are lost. The image folds over itself, so the
/// light of many pixels lands on one point (a caustic). Light between the planes by way of the mirror is left
/// out. Other pixels see their own point.
Optics mirror_patch(const Groove& groove);
/// True on the mirror of mirror_patch(), where the groove has no diffuse surface.
bool on_mirror(const Groove& groove, int row, int col);

/// V × W coaxial views of one groove, tiled in one picture. View (i, j) has the offset (i − (V − 1)/2, j − (W
/// − 1)/2). It sees a point at depth z shifted by offset · parallax · (z − mean depth), parallax = 0.12.
/// Tiles consist of whole cells of fine × fine pixels, and differ by at most one cell if the grid is not
/// divisible. A pixel that looks past the groove sees nothing. Each view has 1/(V W) of the light, so row
/// sums are the same as for one view.
struct TiledViews {
  Grid scene;  ///< of the single groove behind the views
  Optics optics;
  /// The scene row (channel 0) and column (channel 1) that each pixel of the rig sees. It may be outside the
  /// groove.
  Image<float> surface;
};
TiledViews tiled_views(Grid grid, ViewLayout views, int fine = 1);

}  // namespace symrig::sim
