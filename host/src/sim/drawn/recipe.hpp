// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/drawn/solid.hpp"
#include "symrig/image/grid.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::sim::drawn {

/// How the albedo of a surface varies.
enum class Spectrum : std::uint8_t {
  white,    ///< not at all
  coarse,   ///< bumps of a third to an eighth of the picture
  fractal,  ///< amplitude 1/f: all octaves down to two points have equal power
  patches,  ///< patches of one albedo each, with sharp edges
  grain,    ///< each point by itself: a flat spectrum
};
inline constexpr int kSpectra = 5;
inline constexpr std::array<std::string_view, kSpectra> kSpectrumNames{"white", "coarse", "1/f", "patches",
                                                                       "grain"};

/// A picture of numbers from 0 to 1 with a given spectrum.
struct Texture {
  Spectrum spectrum = Spectrum::white;
  std::uint64_t key = 0;
  double cells = 6;  ///< bumps or patches along the longer side

  /// The number of a point of the grid.
  float at(Grid grid, int row, int col) const;
};

/// Light that enters a surface and leaves it elsewhere on the same body.
struct Translucency {
  double share = 0;           ///< of the reflected light; 0: the body is opaque
  double near = 0, far = 0;   ///< widths of two Gaussians [points]
  double far_share = 0;       ///< of that light: in the wide Gaussian
  std::uint64_t speckle = 0;  ///< if not 0: the wide Gaussian is speckled, with this key
};

/// A surface.
struct Finish {
  Texture texture;
  double dark = 0, bright = 0;          ///< the albedo for 0 and 1 of the texture
  std::array<double, 3> tint{1, 1, 1};  ///< factor on the albedo of each channel
  double gloss = 0;                     ///< height of the lobe against the diffuse light
  int sharpness = 0;                    ///< the lobe is (n · h)^(2^sharpness)
  double mirror = 0;                    ///< reflectance; if not 0, the surface scatters nothing
  Translucency translucency;
};

/// A convex solid of one finish. unseen: the rig looks past it, because it is thin and edge-on.
struct Body {
  Solid solid;
  Finish finish;
  bool unseen = false;
};

enum class Ground : std::uint8_t { none, wall, groove, corner };

/// All that a seed draws: the scene of one grid. Lengths in points of the grid.
struct Recipe {
  Ground ground = Ground::none;
  std::vector<Body> bodies;
  double exchange = 1;    ///< factor on the light between surfaces
  double speckle = 0;     ///< relative spread of the light between far surfaces
  double haze = 0;        ///< share of light that reaches every surface from every other, speckled
  std::uint64_t key = 0;  ///< for what is left to draw
};

/// Draws a scene. Ingredients have keys of their own, so that a new ingredient does not change the others.
/// Proportions depend only on the seed; lengths scale with the longer side. docs/research/random-scenes.md
/// states the distribution.
Recipe draw_recipe(int seed, Grid grid);

/// What is in a scene, in a few words: "groove, 3 balls, 1/f + white, gloss".
std::string ingredients(const Recipe& recipe);

}  // namespace symrig::sim::drawn
