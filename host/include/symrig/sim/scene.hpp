// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/view_layout.hpp"

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// `sim:<name>[?key=value&...]`, parsed. docs/command-line.md lists names, keys and
/// defaults.
struct SceneUri {
  std::string name = "plane";
  Grid size{128, 128};
  int seed = 1;
  int channels = 1;
  bool camera_noise = true;  ///< noise=camera (true) or noise=off
  double black = 0.0005;     ///< projector black level, share of white; forced to 0 with noise=off
  double psf = 0;
  double misalign = 0;
  double flare = 0;
  double dead = 0;
  double indirect = 1;
  int exposures = 4;  ///< frames a photograph; 0 (exposures=auto): planned for each photograph
  double ratio = 8;
  double drift = 0;
  double gamma = 1;  ///< other than 1: the projector has 256 levels, light = (level / 255)^gamma
  double light = 1;  ///< what a grey filter before the camera lets through: exposures are longer by 1 / light

  std::string to_string()
      const;  ///< canonical: "sim:name?size=…&…", keys that differ from their default only (size always)
};

/// fails: unknown_name (scene or key, with the list of known ones and the nearest), bad_argument (value out
/// of range).
Result<SceneUri> parse_scene_uri(std::string_view uri);

/// All scenes, by the names that `sim:NAME` takes.
std::span<const std::string_view> scene_names();

/// A key of `sim:NAME?key=value`.
struct SceneKey {
  std::string_view name;
  std::string standard;  ///< its value where nobody gives one
  std::string_view meaning;
};
/// All keys, for help and documents.
std::span<const SceneKey> scene_keys();

/// The coaxial views that tile the scene's grid: 2x2 in views2, 3x3 in views3, else one.
ViewLayout views_of(const SceneUri& uri);

/// A scene with a known T: the ideal coaxial rig's (psf included; no misalignment, flare, dead pixels or
/// noise). T is exactly symmetric by construction and never formed. Thread-safe for reading.
class Scene {
 public:
  Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  virtual ~Scene() = default;

  virtual Grid grid() const = 0;
  virtual int channels() const = 0;
  /// y = T p for one channel, raster order. p and y: grid().size() values, not overlapping. Signed p is
  /// allowed (error metrics).
  virtual void apply(std::span<const float> p, std::span<float> y, int channel) const = 0;

  /// photograph = T · pattern, all channels.
  Image<float> apply(const Image<float>& pattern) const;
};

/// fails: limit (a grid too large for this scene), bad_argument.
Result<std::unique_ptr<Scene>> make_scene(const SceneUri& uri);

}  // namespace symrig
