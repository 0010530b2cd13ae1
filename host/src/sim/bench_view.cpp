// SPDX-License-Identifier: Apache-2.0
#include "sim/light/optics.hpp"
#include "sim/light/transport.hpp"
#include "sim/scenes.hpp"
#include "sim/view.hpp"
#include "symrig/image/outline.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

namespace symrig::sim {
namespace {

/// 1 − loss · (distance from the middle / half diagonal)², for a pixel of a picture.
float vignette(Grid grid, int row, int col, double loss) {
  const double y = row + 0.5 - 0.5 * grid.rows, x = col + 0.5 - 0.5 * grid.cols;
  const double corner = 0.25 * (std::pow(grid.rows, 2) + std::pow(grid.cols, 2));
  return static_cast<float>(1 - loss * (y * y + x * x) / corner);
}

Image<float> vignette_picture(Grid grid, double loss) {
  Image<float> picture(grid);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) picture.at(row, col) = vignette(grid, row, col, loss);
  return picture;
}

CornerMap corners_of(const BenchMap& map, int channel, double moved) {
  const Grid camera = map.camera();
  CornerMap corners({camera.rows + 1, camera.cols + 1}, 2);
  tbb::parallel_for(0, camera.rows + 1, [&](int row) {
    for (int col = 0; col <= camera.cols; ++col) {
      const Point at = map.look({static_cast<double>(row), static_cast<double>(col)}, channel, moved);
      corners.at(row, col, 0) = at.row;
      corners.at(row, col, 1) = at.col;
    }
  });
  return corners;
}

/// A and C of one channel: the points that each camera pixel averages.
class PixelWeights {
 public:
  PixelWeights(const SceneUri& uri, Grid camera, Grid points)
      : fine_(uri.fine), ghost_(uri.ghost), loss_(uri.vignetting.camera), camera_(camera), points_(points) {}

  Optics optics(const CornerMap& corners) const {
    std::vector<std::vector<std::pair<std::uint32_t, float>>> rows(static_cast<std::size_t>(camera_.size()));
    tbb::parallel_for(0, camera_.rows, [&](int row) {
      std::vector<Overlap> scratch;
      for (int col = 0; col < camera_.cols; ++col) {
        auto& points = rows[static_cast<std::size_t>(row) * static_cast<std::size_t>(camera_.cols) +
                            static_cast<std::size_t>(col)];
        Outline outline = outline_of(corners, row, col);
        for (Point& p : outline) p = {p.row * fine_, p.col * fine_};
        const auto gain = static_cast<double>(vignette(camera_, row, col, loss_));
        add(outline, {}, gain * (1 - ghost_.share), scratch, points);
        if (ghost_.share > 0) add(outline, ghost_.at, gain * ghost_.share, scratch, points);
      }
    });
    Optics optics(static_cast<std::size_t>(points_.size()));
    for (const auto& points : rows) {
      for (const auto& [point, weight] : points) optics.add(point, weight);
      optics.end_pixel();
    }
    return optics;
  }

 private:
  void add(const Outline& outline, const Offset& from, double share, std::vector<Overlap>& scratch,
           std::vector<std::pair<std::uint32_t, float>>& points) const {
    Outline there = outline;
    for (Point& p : there) p = {p.row + from.row * fine_, p.col + from.col * fine_};
    cut_outline(there, points_, scratch);
    const double each = share / area_of(there);
    for (const Overlap& o : scratch)
      points.emplace_back(static_cast<std::uint32_t>(o.row) * static_cast<std::uint32_t>(points_.cols) +
                              static_cast<std::uint32_t>(o.col),
                          static_cast<float>(each * o.area));
  }

  int fine_;
  Ghost ghost_;
  double loss_;
  Grid camera_, points_;
};

class BenchView final : public CameraView {
 public:
  BenchView(const SceneUri& uri, std::shared_ptr<const Scene> points)
      : uri_(with_camera(uri)),
        points_(std::move(points)),
        map_(uri_, depth_of(uri_)),
        projector_gain_(vignette_picture(uri_.size, uri_.vignetting.projector)) {
    if (uri_.defocus.camera > 0) camera_blur_.emplace(points_->grid(), uri_.defocus.camera * uri_.fine);
    if (uri_.defocus.projector > 0)
      projector_blur_.emplace(points_->grid(), uri_.defocus.projector * uri_.fine);
    if (!moves()) optics_ = optics_after(0);
  }

  Grid camera() const override { return map_.camera(); }
  int channels() const override { return points_->channels(); }
  bool moves() const override { return uri_.moves != 0; }
  std::vector<CornerMap> corners() const override {
    std::vector<CornerMap> maps;
    maps.reserve(static_cast<std::size_t>(different_channels()));
    for (int c = 0; c < different_channels(); ++c) maps.push_back(corners_of(map_, c, 0));
    return maps;
  }
  Image<float> see(const Image<float>& light, std::uint64_t shown_before) const override;
  Image<float> flood_shares() const override;
  Image<float> camera_gain() const override { return vignette_picture(camera(), uri_.vignetting.camera); }
  Image<float> projector_gain() const override { return projector_gain_; }

 private:
  /// A camera without a size of its own has a pixel for each cell.
  static SceneUri with_camera(SceneUri uri) {
    if (!uri.own_camera()) uri.camera = uri.size;
    return uri;
  }
  int different_channels() const { return uri_.colour != 0 ? channels() : 1; }
  std::vector<Optics> optics_after(std::uint64_t shown_before) const;
  std::vector<float> lit(const Image<float>& light) const;
  std::vector<float> radiance(std::span<const float> lit_points, int channel) const;

  SceneUri uri_;
  std::shared_ptr<const Scene> points_;
  BenchMap map_;
  Image<float> projector_gain_;
  std::optional<GaussianBlur> camera_blur_, projector_blur_;
  std::vector<Optics> optics_;  // one a channel, or one for all; none if the camera moves
};

std::vector<Optics> BenchView::optics_after(std::uint64_t shown_before) const {
  const double moved = uri_.moves * static_cast<double>(shown_before) / 1000;
  const PixelWeights weights(uri_, camera(), points_->grid());
  std::vector<Optics> optics;
  optics.reserve(static_cast<std::size_t>(different_channels()));
  for (int c = 0; c < different_channels(); ++c) optics.push_back(weights.optics(corners_of(map_, c, moved)));
  return optics;
}

/// The light that falls on the scene's points.
std::vector<float> BenchView::lit(const Image<float>& light) const {
  const Grid points = points_->grid();
  std::vector<float> lit(static_cast<std::size_t>(points.size()));
  for (int row = 0; row < points.rows; ++row)
    for (int col = 0; col < points.cols; ++col) {
      const int r = row / uri_.fine, c = col / uri_.fine;
      lit[static_cast<std::size_t>(row) * static_cast<std::size_t>(points.cols) +
          static_cast<std::size_t>(col)] = light.at(r, c) * projector_gain_.at(r, c);
    }
  if (!projector_blur_) return lit;
  std::vector<float> blurred(lit.size());
  projector_blur_->add(1, lit, blurred);
  return blurred;
}

/// What leaves the scene's points towards the camera, as its optics show them.
std::vector<float> BenchView::radiance(std::span<const float> lit_points, int channel) const {
  std::vector<float> sharp(lit_points.size());
  points_->apply(lit_points, sharp, channel);
  if (!camera_blur_) return sharp;
  std::vector<float> blurred(sharp.size());
  camera_blur_->add(1, sharp, blurred);
  return blurred;
}

Image<float> BenchView::flood_shares() const {
  const std::vector<float> white = lit(Image<float>(uri_.size, 1, 1.F));
  const int maps = different_channels();
  Image<float> shares(camera(), 2 * maps, 1.F);
  for (int m = 0; m < maps; ++m) {
    std::vector<float> light = radiance(white, m);
    for (int c = 1; maps == 1 && c < channels(); ++c)
      std::ranges::transform(light, radiance(white, c), light.begin(), std::plus<>());
    const CornerMap corners = corners_of(map_, m, 0);
    tbb::parallel_for(0, camera().rows, [&](int row) {
      std::vector<Overlap> parts;
      for (int col = 0; col < camera().cols; ++col) {
        Outline outline = outline_of(corners, row, col);
        for (Point& p : outline) p = {p.row * uri_.fine, p.col * uri_.fine};
        cut_outline(outline, points_->grid(), parts);
        if (parts.empty()) continue;
        const auto by_row = [](const Overlap& a, const Overlap& b) { return a.row < b.row; };
        const auto by_col = [](const Overlap& a, const Overlap& b) { return a.col < b.col; };
        const int first_row = std::ranges::min_element(parts, by_row)->row / uri_.fine;
        const int first_col = std::ranges::min_element(parts, by_col)->col / uri_.fine;
        double all = 0, in_row = 0, in_col = 0;
        for (const Overlap& o : parts) {
          const double one =
              o.area *
              static_cast<double>(
                  light[static_cast<std::size_t>(std::int64_t{o.row} * points_->grid().cols + o.col)]);
          all += one;
          in_row += o.row / uri_.fine == first_row ? one : 0;
          in_col += o.col / uri_.fine == first_col ? one : 0;
        }
        if (!(all > 0)) continue;
        shares.at(row, col, 2 * m) = static_cast<float>(std::clamp(in_row / all, 0.0, 1.0));
        shares.at(row, col, 2 * m + 1) = static_cast<float>(std::clamp(in_col / all, 0.0, 1.0));
      }
    });
  }
  return shares;
}

Image<float> BenchView::see(const Image<float>& light, std::uint64_t shown_before) const {
  const std::vector<float> lit_points = lit(light);
  std::vector<Optics> now;
  if (moves()) now = optics_after(shown_before);
  const std::vector<Optics>& optics = moves() ? now : optics_;
  Image<float> seen(camera(), channels());
  for (int c = 0; c < channels(); ++c) {
    const std::size_t which = optics.size() == 1 ? 0 : static_cast<std::size_t>(c);
    optics[which].see(radiance(lit_points, c), seen.plane(c));
  }
  return seen;
}

}  // namespace

std::unique_ptr<const CameraView> bench_view(const SceneUri& uri, std::shared_ptr<const Scene> points) {
  return std::make_unique<BenchView>(uri, std::move(points));
}

}  // namespace symrig::sim
