// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/statistics.hpp"
#include "symrig/image/grid.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace symrig::benchmark {

/// Draws the numbers of one scene. The same seed gives the same scene on every machine.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed * 0xD1342543DE82EF95U) {}

  /// In (0, 1).
  double uniform() { return random_.uniform() + 0x1p-54; }
  double between(double low, double high) { return low + (high - low) * uniform(); }
  /// Even in the logarithm.
  double scale(double low, double high) { return low * std::pow(high / low, uniform()); }
  bool chance(double share) { return uniform() < share; }
  double normal() {
    const double radius = std::sqrt(-2 * std::log(uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

 private:
  Random random_;
};

/// What a point of the picture shows.
struct SurfacePoint {
  double col = 0, row = 0;  ///< position on the projector [projector pixels]
  double depth = 0;         ///< towards the projector [projector pixels of parallax]
  int layer = 0;            ///< points of one layer are one continuous surface
};

/// The map from camera to projector: a perspective, bent by a curved surface, with steps where something
/// stands in front.
class RandomGeometry {
 public:
  /// cover: the share of the picture that the projector lights is about a quarter, else most of it.
  RandomGeometry(Draw& draw, Grid camera, bool quarter) : camera_(camera) {
    // One picture in five is taken by a camera on its side or upside down.
    turn_ = draw.between(-0.45, 0.45);
    if (draw.chance(0.2)) turn_ += std::numbers::pi / 2 * std::ceil(draw.between(0, 3));
    zoom_ = draw.scale(0.45, 1.6);
    stretch_ = draw.scale(0.8, 1.25);
    tilt_x_ = draw.between(-0.2, 0.2) / camera.cols;
    tilt_y_ = draw.between(-0.2, 0.2) / camera.rows;
    draw_projector(draw, quarter);
    draw_surface(draw);
  }

  Grid projector() const { return projector_; }
  double zoom() const { return zoom_; }

  /// (y, x): camera pixels, whole numbers at the centres.
  SurfacePoint at(double y, double x) const {
    const double u = x - 0.5 * camera_.cols, v = y - 0.5 * camera_.rows;
    const double w = 1 + tilt_x_ * u + tilt_y_ * v;
    SurfacePoint point;
    for (const Wave& wave : waves_)
      point.depth += wave.height * std::sin(wave.by_x * x + wave.by_y * y + wave.phase);
    for (std::size_t i = 0; i < blocks_.size(); ++i)
      if (blocks_[i].contains(y, x)) point.depth += blocks_[i].height, point.layer |= 1 << i;
    point.col = centre_col_ + zoom_ * (std::cos(turn_) * u - std::sin(turn_) * v) / w +
                point.depth * std::cos(parallax_);
    point.row = centre_row_ + zoom_ * stretch_ * (std::sin(turn_) * u + std::cos(turn_) * v) / w +
                point.depth * std::sin(parallax_);
    return point;
  }

 private:
  struct Wave {
    double height, by_x, by_y, phase;
  };
  /// A part that stands in front: an ellipse, or a half plane (a step).
  struct Block {
    double y, x, radius_y, radius_x, height, angle;
    bool half;
    bool contains(double at_y, double at_x) const {
      const double dy = at_y - y, dx = at_x - x;
      const double along = std::cos(angle) * dx + std::sin(angle) * dy,
                   across = std::cos(angle) * dy - std::sin(angle) * dx;
      if (half) return along > 0;
      return along * along / (radius_x * radius_x) + across * across / (radius_y * radius_y) < 1;
    }
  };

  void draw_projector(Draw& draw, bool quarter) {
    constexpr Grid kProjectors[] = {{768, 1024}, {800, 1280}, {480, 854}, {1080, 1920}};
    projector_ = kProjectors[static_cast<std::size_t>(draw.between(0, 4))];
    // The middle of the picture lies anywhere on the projector, so the border may be in view.
    centre_col_ = draw.between(0.25, 0.75) * projector_.cols;
    centre_row_ = draw.between(0.25, 0.75) * projector_.rows;
    if (!quarter) return;
    projector_ = {static_cast<int>(0.5 * zoom_ * stretch_ * camera_.rows),
                  static_cast<int>(0.5 * zoom_ * camera_.cols)};
    centre_col_ = 0.5 * projector_.cols, centre_row_ = 0.5 * projector_.rows;
  }

  void draw_surface(Draw& draw) {
    parallax_ = draw.between(0, 2 * std::numbers::pi);
    for (int i = 0; i < 2; ++i) {
      const double length = draw.scale(50, 300), direction = draw.between(0, 2 * std::numbers::pi);
      const double turns = 2 * std::numbers::pi / length;
      // The steepest slope changes the map's scale by up to a third.
      waves_.push_back({draw.between(0, 0.17) * zoom_ / turns, turns * std::cos(direction),
                        turns * std::sin(direction), draw.between(0, 2 * std::numbers::pi)});
    }
    const int blocks = static_cast<int>(draw.between(0, 4));
    for (int i = 0; i < blocks; ++i)
      blocks_.push_back({draw.between(0.1, 0.9) * camera_.rows, draw.between(0.1, 0.9) * camera_.cols,
                         draw.between(0.08, 0.25) * camera_.rows, draw.between(0.08, 0.25) * camera_.rows,
                         draw.scale(4, 30) * zoom_, draw.between(0, 2 * std::numbers::pi), draw.chance(0.3)});
  }

  Grid camera_, projector_;
  double turn_ = 0, zoom_ = 1, stretch_ = 1, tilt_x_ = 0, tilt_y_ = 0;
  double centre_col_ = 0, centre_row_ = 0, parallax_ = 0;
  std::vector<Wave> waves_;
  std::vector<Block> blocks_;
};

}  // namespace symrig::benchmark
