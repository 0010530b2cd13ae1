// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "random_geometry.hpp"
#include "symrig/calibration/gray_code.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace symrig::benchmark {

/// What is drawn for one sequence besides its geometry.
struct RandomOptics {
  double projector_blur, camera_blur;  ///< sigma [projector pixels], [camera pixels]
  double leak;                         ///< projector's black, share of white
  double ambient;                      ///< share of the brightest white
  double brightest;                    ///< level of white that 0.5 % of the pixels exceed, 1 = largest code
  double far, facing;  ///< indirect light: from everywhere near, from a surface that faces this one
  double far_reach, facing_reach;  ///< sigma [camera pixels]
  double fold;                     ///< camera column where the facing surface begins
  double read_noise, shot_slope;   ///< rms in the dark, variance a level; 1 = largest code
  int bits;                        ///< of a code

  RandomOptics(Draw& draw, Grid camera)
      : projector_blur(draw.scale(0.2, 1.2)),
        camera_blur(draw.scale(0.2, 1)),
        leak(draw.scale(0.0005, 0.005)),
        ambient(draw.scale(0.005, 0.2)),
        brightest(draw.scale(40, 200) / 255),
        far(draw.between(0, 0.4)),
        facing(draw.between(0, 0.3)),
        far_reach(draw.scale(16, 100)),
        facing_reach(draw.scale(4, 16)),
        fold(draw.between(0.2, 0.8) * camera.cols),
        read_noise(draw.scale(0.2, 2) / 255),
        shot_slope(std::pow(draw.scale(0.5, 3) / 255, 2)),
        bits(draw.chance(0.5) ? 8 : 12) {}

  /// Variance of one photograph's pixel, with the rounding to codes.
  double variance(double level) const {
    const double step = 1 / (std::exp2(bits) - 1);
    return read_noise * read_noise + shot_slope * level + step * step / 12;
  }
};

/// Separable Gaussian; beyond the border the border's value goes on. stride: every how many values are kept.
inline Image<float> blurred(const Image<float>& image, double sigma, int stride, int box) {
  // A box of `box` values and a Gaussian, at the middle of each group of `stride`.
  const int reach = static_cast<int>(std::ceil(3.5 * sigma)) + box / 2;
  std::vector<float> weight(2 * static_cast<std::size_t>(reach) + 1, 0);
  for (int k = -reach; k <= reach; ++k)
    for (int b = -(box / 2); b <= box / 2; ++b)
      weight[k + reach] += static_cast<float>(std::exp(-0.5 * (k - b) * (k - b) / (sigma * sigma)));
  float sum = 0;
  for (const float w : weight) sum += w;
  for (float& w : weight) w /= sum;
  const Grid fine = image.grid(), grid{fine.rows / stride, fine.cols / stride};
  Image<float> across({fine.rows, grid.cols}), out(grid);
  for (int r = 0; r < fine.rows; ++r)
    for (int c = 0; c < grid.cols; ++c)
      for (int k = -reach; k <= reach; ++k)
        across.at(r, c) +=
            weight[k + reach] * image.at(r, std::clamp(c * stride + stride / 2 + k, 0, fine.cols - 1));
  for (int r = 0; r < grid.rows; ++r)
    for (int k = -reach; k <= reach; ++k) {
      const int from = std::clamp(r * stride + stride / 2 + k, 0, fine.rows - 1);
      for (int c = 0; c < grid.cols; ++c) out.at(r, c) += weight[k + reach] * across.at(from, c);
    }
  return out;
}

/// Light of a pattern along one axis of the projector, after the projector's blur.
class Profile {
 public:
  /// lit: of each projector pixel. The table is a sum of samples: no formula is shared with the decoder.
  Profile(const std::vector<float>& lit, double sigma)
      : margin_(static_cast<int>(std::ceil(4 * sigma)) + 2),
        table_((lit.size() + 2 * static_cast<std::size_t>(margin_)) * kSteps) {
    const int reach = static_cast<int>(std::ceil(4 * sigma * kSteps));
    std::vector<double> weight;
    double sum = 0;
    for (int k = -reach; k <= reach; ++k) {
      weight.push_back(std::exp(-0.5 * k * k / (sigma * sigma * kSteps * kSteps)));
      sum += weight.back();
    }
    const int end = static_cast<int>(lit.size()) * kSteps;
    for (std::size_t i = 0; i < table_.size(); ++i)
      for (int k = -reach; k <= reach; ++k) {
        const int from = static_cast<int>(i) - margin_ * kSteps + k;
        if (from >= 0 && from < end)
          table_[i] += static_cast<float>(weight[k + reach] / sum) * lit[from / kSteps];
      }
  }

  /// Place of a position in the tables of all profiles of one axis, or nowhere.
  struct Place {
    int index = -1;
    float share = 0;
  };
  Place place(double position) const {
    // Sample i is at (i + ½) / kSteps − ½ − margin.
    const double at = (position + 0.5 + margin_) * kSteps - 0.5;
    if (!(at >= 0) || at >= static_cast<double>(table_.size() - 1)) return {};
    const int index = static_cast<int>(at);
    return {index, static_cast<float>(at - index)};
  }
  float operator()(Place place) const {
    if (place.index < 0) return 0;
    return table_[place.index] + place.share * (table_[place.index + 1] - table_[place.index]);
  }

 private:
  static constexpr int kSteps = 16;
  int margin_;
  std::vector<float> table_;
};

/// A simulated sequence and its truth, camera grid.
struct RandomSequence {
  CodePhotographs photographs;
  Image<float> col, row;  ///< position that the middle of a pixel sees
  Image<int> layer;       ///< of the middle
  Image<float> direct;    ///< white − black by way of the projector's light alone, without noise
  Image<float> fine;      ///< amplitude of the finest stripes, the axis where it is smaller
  Image<float> sigma;     ///< of a difference of two photographs
  int edge = 1;           ///< pixels that a second layer's light reaches
};

/// Makes the photographs of one scene.
class SequenceCamera {
 public:
  SequenceCamera(Grid camera, const RandomGeometry& geometry, const RandomOptics& optics, Draw& draw)
      : camera_(camera), geometry_(geometry), optics_(optics), code_(geometry.projector()) {
    for (int axis = 0; axis < 2; ++axis) {
      const int size = axis == 0 ? geometry.projector().cols : geometry.projector().rows;
      all_.emplace_back(std::vector<float>(static_cast<std::size_t>(size), 1.0F), optics.projector_blur);
    }
    see_surface();
    paint(draw);
    cast_shadows();
    albedo_ = blurred(paint_, kFine * optics_.camera_blur, kFine, kFine);
  }

  RandomSequence photograph(Draw& draw) const {
    RandomSequence out{{code_, {}, {}}, {}, {}, {}, {}, {}, {}, 1};
    out.edge = static_cast<int>(std::ceil(2 * optics_.camera_blur)) + 1;
    describe(out);
    const Image<float> white_direct = direct(-1), white = with_indirect(white_direct);
    std::vector<float> sorted(white.values().begin(), white.values().end());
    const auto high =
        sorted.begin() + static_cast<std::ptrdiff_t>(0.995 * static_cast<double>(sorted.size()));
    std::ranges::nth_element(sorted, high);
    const double gain = optics_.brightest / static_cast<double>(*high);
    Image<float> energy[2] = {Image<float>(camera_), Image<float>(camera_)};
    for (int pair = 0; pair < code_.pairs(); ++pair) {
      const Image<float> part = direct(pair), light = with_indirect(part);
      expose(out, light, white, gain, false, draw);
      expose(out, light, white, gain, true, draw);
      const StripePair stripes = code_.pair(pair);
      if (stripes.bit + 1 != code_.bits(stripes.axis)) continue;
      for (std::size_t i = 0; i < part.values().size(); ++i)
        energy[stripes.axis == StripeAxis::columns ? 0 : 1].values()[i] = static_cast<float>(std::pow(
            gain * (1 - optics_.leak) * static_cast<double>(2 * part.values()[i] - white_direct.values()[i]),
            2));
    }
    expose(out, white, white, gain, false, draw);
    expose(out, Image<float>(camera_), white, gain, false, draw);
    judge_light(out, white_direct, white, gain, energy);
    return out;
  }

 private:
  static constexpr int kFine = 3;  // samples a pixel, along each axis

  Grid fine_grid() const { return {kFine * camera_.rows, kFine * camera_.cols}; }
  static double camera_position(int sample) { return (sample + 0.5) / kFine - 0.5; }

  void see_surface() {
    depth_ = Image<float>(fine_grid());
    x_ = Image<Profile::Place>(fine_grid()), y_ = Image<Profile::Place>(fine_grid());
    for (int r = 0; r < fine_grid().rows; ++r)
      for (int c = 0; c < fine_grid().cols; ++c) {
        const SurfacePoint point = geometry_.at(camera_position(r), camera_position(c));
        x_.at(r, c) = all_[0].place(point.col), y_.at(r, c) = all_[1].place(point.row);
        depth_.at(r, c) = static_cast<float>(point.depth);
      }
  }

  /// Reflectance: fields of a board, a smooth texture, dark parts; a factor for each layer.
  void paint(Draw& draw) {
    const double field = draw.scale(10, 50), contrast = draw.between(0, 0.9);
    const double wave_r = draw.between(0.02, 0.3), wave_c = draw.between(0.02, 0.3);
    const double dark = draw.scale(0.05, 1), dark_col = draw.uniform() * camera_.cols;
    double layers[8];
    for (double& factor : layers) factor = draw.scale(0.3, 1);
    paint_ = Image<float>(fine_grid());
    for (int r = 0; r < fine_grid().rows; ++r)
      for (int c = 0; c < fine_grid().cols; ++c) {
        const double y = camera_position(r), x = camera_position(c);
        const bool odd = (std::lround(std::floor(y / field)) + std::lround(std::floor(x / field))) % 2 != 0;
        double value = (odd ? 1 : 1 - contrast) * (0.8 + 0.2 * std::sin(wave_r * y) * std::cos(wave_c * x));
        if (std::abs(x - dark_col) < 0.15 * camera_.cols) value *= dark;
        paint_.at(r, c) = static_cast<float>(value * layers[geometry_.at(y, x).layer]);
      }
  }

  /// A point is in shadow if another one on the same ray of the projector is nearer to it.
  void cast_shadows() {
    const double cell = std::max(1.0, geometry_.zoom());
    constexpr float kNearer = 3;  // projector pixels of parallax; more than a slope changes within a cell
    const Grid projector = code_.projector();
    const Grid cells{static_cast<int>(projector.rows / cell) + 1,
                     static_cast<int>(projector.cols / cell) + 1};
    Image<float> nearest(cells, 1, -1e9F);
    Image<int> where(fine_grid(), 1, -1);
    for (int r = 0; r < fine_grid().rows; ++r)
      for (int c = 0; c < fine_grid().cols; ++c) {
        const SurfacePoint point = geometry_.at(camera_position(r), camera_position(c));
        if (point.col < 0 || point.row < 0 || point.col >= projector.cols || point.row >= projector.rows)
          continue;
        const int cell_r = static_cast<int>(point.row / cell), cell_c = static_cast<int>(point.col / cell);
        where.at(r, c) = cell_r * cells.cols + cell_c;
        nearest.at(cell_r, cell_c) = std::max(nearest.at(cell_r, cell_c), depth_.at(r, c));
      }
    lit_paint_ = paint_;
    for (std::size_t i = 0; i < where.values().size(); ++i)
      if (where.values()[i] >= 0 && nearest.values()[where.values()[i]] > depth_.values()[i] + kNearer)
        lit_paint_.values()[i] = 0;
  }

  /// What the camera sees of a pair's pattern, or of white (−1), by way of no other surface.
  Image<float> direct(int pair) const {
    const Image<float> samples = lit_samples(pair);
    return blurred(samples, kFine * optics_.camera_blur, kFine, kFine);
  }

  Image<float> lit_samples(int pair) const {
    const bool columns = pair >= 0 && code_.pair(pair).axis == StripeAxis::columns;
    const int size = columns ? code_.projector().cols : code_.projector().rows;
    std::vector<float> lit;
    for (int i = 0; pair >= 0 && i < size; ++i) lit.push_back(code_.lit(pair, i) ? 1.0F : 0.0F);
    const Profile stripes(lit, optics_.projector_blur);
    const Profile& along = pair < 0 || !columns ? all_[0] : stripes;
    const Profile& down = pair < 0 || columns ? all_[1] : stripes;
    Image<float> samples(fine_grid());
    for (std::size_t i = 0; i < samples.values().size(); ++i)
      if (lit_paint_.values()[i] > 0)
        samples.values()[i] = lit_paint_.values()[i] * along(x_.values()[i]) * down(y_.values()[i]);
    return samples;
  }

  /// Adds one more bounce: from everywhere near, and from the other side of a fold, as in a mirror that is
  /// not sharp.
  Image<float> with_indirect(const Image<float>& direct) const {
    constexpr int kCoarse = 4;
    const Image<float> coarse = blurred(direct, kCoarse / 2.0, kCoarse, 1);
    const Image<float> far = blurred(coarse, optics_.far_reach / kCoarse, 1, 1),
                       near = blurred(coarse, optics_.facing_reach / kCoarse, 1, 1);
    Image<float> out = direct;
    for (int r = 0; r < camera_.rows; ++r)
      for (int c = 0; c < camera_.cols; ++c) {
        const double y = (r - 2.0) / kCoarse, x = (c - 2.0) / kCoarse;
        const double facing = (2 * optics_.fold - c - 2) / kCoarse;
        const bool faces = facing >= 0 && facing < near.grid().cols;
        const double light =
            optics_.far * between(far, y, x) + (faces ? optics_.facing * between(near, y, facing) : 0);
        out.at(r, c) += static_cast<float>(light) * albedo_.at(r, c);
      }
    return out;
  }

  static double between(const Image<float>& image, double y, double x) {
    y = std::clamp(y, 0.0, image.grid().rows - 1.001), x = std::clamp(x, 0.0, image.grid().cols - 1.001);
    const int r = static_cast<int>(y), c = static_cast<int>(x);
    const double v = y - r, u = x - c;
    const auto at = [&](int dr, int dc) { return static_cast<double>(image.at(r + dr, c + dc)); };
    return (1 - v) * ((1 - u) * at(0, 0) + u * at(0, 1)) + v * ((1 - u) * at(1, 0) + u * at(1, 1));
  }

  /// Takes one photograph of a pattern or its complement.
  void expose(RandomSequence& out, const Image<float>& light, const Image<float>& white, double gain,
              bool complement, Draw& draw) const {
    Image<float> image(camera_);
    const double largest = std::exp2(optics_.bits) - 1;
    for (std::size_t i = 0; i < image.values().size(); ++i) {
      const auto w = static_cast<double>(white.values()[i]), p = static_cast<double>(light.values()[i]);
      const double shown = optics_.leak * w + (1 - optics_.leak) * (complement ? w - p : p);
      const double level = gain * shown + ambient(i);
      const double noisy = level + std::sqrt(optics_.variance(level) - rounding()) * draw.normal();
      image.values()[i] = static_cast<float>(std::round(largest * std::clamp(noisy, 0.0, 1.0)) / largest);
    }
    out.photographs.names.push_back("photograph " + std::to_string(out.photographs.images.size()));
    out.photographs.images.push_back(std::move(image));
  }
  double rounding() const { return std::pow(1 / (std::exp2(optics_.bits) - 1), 2) / 12; }
  /// The dark level keeps noise away from code 0.
  double ambient(std::size_t i) const {
    return 4 * optics_.read_noise +
           optics_.ambient * optics_.brightest * static_cast<double>(albedo_.values()[i]);
  }

  void describe(RandomSequence& out) const {
    out.col = out.row = out.direct = out.fine = out.sigma = Image<float>(camera_);
    out.layer = Image<int>(camera_);
    for (int r = 0; r < camera_.rows; ++r)
      for (int c = 0; c < camera_.cols; ++c) {
        const SurfacePoint point = geometry_.at(r, c);
        out.col.at(r, c) = static_cast<float>(point.col), out.row.at(r, c) = static_cast<float>(point.row);
        out.layer.at(r, c) = point.layer;
      }
  }

  void judge_light(RandomSequence& out, const Image<float>& white_direct, const Image<float>& white,
                   double gain, const Image<float> (&energy)[2]) const {
    // Twice the mean square over about a period of the stripes is the square of their amplitude.
    const Image<float> mean[2] = {blurred(energy[0], 1.5, 1, 1), blurred(energy[1], 1.5, 1, 1)};
    for (std::size_t i = 0; i < white.values().size(); ++i) {
      const double level = ambient(i) + 0.5 * gain * static_cast<double>(white.values()[i]);
      out.sigma.values()[i] = static_cast<float>(std::sqrt(2 * optics_.variance(level)));
      out.direct.values()[i] =
          static_cast<float>(gain * (1 - optics_.leak) * static_cast<double>(white_direct.values()[i]));
      out.fine.values()[i] = std::sqrt(2 * std::min(mean[0].values()[i], mean[1].values()[i]));
    }
  }

  Grid camera_;
  const RandomGeometry& geometry_;
  const RandomOptics& optics_;
  GrayCode code_;
  std::vector<Profile> all_;  ///< white along each axis
  Image<Profile::Place> x_, y_;
  Image<float> depth_, paint_, lit_paint_;  ///< samples
  Image<float> albedo_;                     ///< camera grid
};

}  // namespace symrig::benchmark
