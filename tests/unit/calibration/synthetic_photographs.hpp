// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>

namespace symrig::test {

/// A textured surface seen by a camera and lit by a projector, with a known map between them. The photographs
/// are made by sampling each camera pixel's footprint at 9 × 9 points: no formula is shared with the code
/// under test.
struct SyntheticScene {
  Grid camera{120, 150};
  Grid projector{80, 100};
  double blur = 0.6;     ///< sigma of the footprint [projector pixels]
  double far = 0.1;      ///< share of far light
  double black = 0.03;   ///< ambient light and black level
  double noise = 0.004;  ///< rms of a photograph's pixel (one code of 8 bits)
  bool mirrored = false;

  /// Projector position seen by a camera pixel: a perspective with a bend, never aligned with either grid.
  double col(int r, int c) const {
    const double x = mirrored ? camera.cols - 1 - c : c;
    return 3 + 0.62 * x + 0.05 * r + 2 * std::sin(x / 40.0);
  }
  static double row(int r, int c) { return 2.5 + 0.6 * r - 0.03 * c + 1.5 * std::cos(r / 35.0); }
  /// Shadow: no direct light.
  static bool shadow(int r, int c) { return r > 95 && c < 40; }
  static double albedo(int r, int c) {
    return 0.55 + 0.2 * std::sin(0.21 * r) * std::cos(0.17 * c) + ((r / 20 + c / 20) % 2 ? 0.15 : -0.15);
  }
};

/// Counter-based normal numbers.
inline double normal(std::uint64_t& counter) {
  const auto uniform = [&] {
    counter += 0x9E3779B97F4A7C15ULL;
    std::uint64_t z = counter;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return (static_cast<double>((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
  };
  const double radius = std::sqrt(-2 * std::log(uniform()));
  return radius * std::cos(2 * std::numbers::pi * uniform());
}

/// Mean of the pattern over the footprint.
inline double light_on_footprint(const SyntheticScene& scene, const Pattern& pattern, int r, int c) {
  double sum = 0, weights = 0;
  for (int i = -4; i <= 4; ++i) {
    for (int j = -4; j <= 4; ++j) {
      const double dy = 0.7 * i * scene.blur, dx = 0.7 * j * scene.blur;
      const int y = static_cast<int>(std::lround(SyntheticScene::row(r, c) + dy)),
                x = static_cast<int>(std::lround(scene.col(r, c) + dx));
      const double w = std::exp(-0.5 * (dx * dx + dy * dy) / (scene.blur * scene.blur));
      const bool inside = y >= 0 && y < pattern.grid().rows && x >= 0 && x < pattern.grid().cols;
      sum += inside ? w * static_cast<double>(pattern.at(y, x)) : 0;
      weights += w;
    }
  }
  return sum / weights;
}

/// What the camera sees, without noise.
inline Image<float> photograph(const SyntheticScene& scene, const Pattern& pattern) {
  const auto values = pattern.values();
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  Image<float> image(scene.camera);
  for (int r = 0; r < scene.camera.rows; ++r)
    for (int c = 0; c < scene.camera.cols; ++c) {
      const double direct =
          SyntheticScene::shadow(r, c) ? 0 : (1 - scene.far) * light_on_footprint(scene, pattern, r, c);
      image.at(r, c) =
          static_cast<float>(scene.black + 0.7 * SyntheticScene::albedo(r, c) * (direct + scene.far * mean));
    }
  return image;
}

/// The whole sequence, with noise and 8-bit codes.
inline CodePhotographs photograph_sequence(const SyntheticScene& scene, std::uint64_t seed = 1) {
  const GrayCode code(scene.projector);
  CodePhotographs photographs{code, {}, {}};
  std::uint64_t counter = seed << 32;
  for (int i = 0; i < code.photographs(); ++i) {
    auto image = photograph(scene, code.pattern(i));
    for (float& v : image.values())
      v = static_cast<float>(
          std::round(255 * std::clamp(static_cast<double>(v) + scene.noise * normal(counter), 0.0, 1.0)) /
          255);
    photographs.images.push_back(std::move(image));
    photographs.names.push_back("photograph " + std::to_string(i));
  }
  return photographs;
}

/// The sequence of the default scene, made once.
inline const CodePhotographs& default_photographs() {
  static const CodePhotographs photographs = photograph_sequence({});
  return photographs;
}

}  // namespace symrig::test
