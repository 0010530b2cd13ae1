// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A displacement on the projector [cells].
struct Offset {
  double row = 0, col = 0;
  bool operator==(const Offset&) const = default;
};

/// A property of both optics.
struct BothOptics {
  double camera = 0, projector = 0;
  bool operator==(const BothOptics&) const = default;
};

/// A second, weaker image.
struct Ghost {
  double share = 0;  ///< of the light
  Offset at;         ///< the second image shows the point this far away
  bool operator==(const Ghost&) const = default;
};

class Scene;

/// A scene that is a matrix of the user, instead of a named one: `dense:FILE?key=value`.
struct GivenScene {
  std::shared_ptr<const Scene> points = {};  ///< T of the scene's points
  ViewLayout views = {};
  double white = 1;      ///< radiance that the simulated exposures take for a white wall's
  double asymmetry = 0;  ///< of the matrix
};

/// A parsed `sim:<name>[?key=value&...]`, or `dense:FILE?key=value` with a key of a simulated rig.
/// `symrig capture --help` lists names, keys and defaults.
struct SceneUri {
  std::string name = "plane";  ///< of a given scene: its file
  std::shared_ptr<const GivenScene> given = {};
  Grid size{128, 128};
  int seed = 1;
  int noise_seed = 0;  ///< the same scene with another draw of the camera's noise
  int channels = 1;
  bool camera_noise = true;  ///< noise=camera (true) or noise=off
  double black = 0.0005;     ///< projector black level, share of white; always 0 with noise=off
  double psf = 0;
  double misalign = 0;
  double flare = 0;
  double dead = 0;
  double indirect = 1;
  int exposures = 0;  ///< frames of a photograph; 0 (exposures=auto): planned for each photograph
  double ratio = 8;
  double drift = 0;
  double gamma = 1;  ///< if not 1: the projector has 256 levels, and light = (level / 255)^gamma
  double light = 1;  ///< transmission of a grey filter before the camera; exposures are 1 / light longer
  std::string profile = "standard";  ///< of the rig's devices: rig_profiles()

  // A bench whose camera has pixels of its own. `symrig capture --help` lists the keys.
  int fine = 1;           ///< the scene has fine × fine points in each cell
  Grid camera{0, 0};      ///< empty: the camera shares the projector's cells
  double turn = 0;        ///< of the camera about the axis [degrees]
  double zoom = 1;        ///< size of the projector's picture in the camera's; 1: it just fits
  Offset shift;           ///< of what the camera looks at [cells]
  double distortion = 0;  ///< radial, share of the distance at the projector's corner
  double parallax = 0;    ///< shift between the nearest and the farthest point of the scene [cells]
  BothOptics vignetting;  ///< light lost at the corner, share
  BothOptics defocus;     ///< rms of a Gaussian [cells]
  double colour = 0;      ///< lateral colour: red against blue at the projector's corner [cells]
  Ghost ghost;            ///< in the camera
  double moves = 0;       ///< the camera's shift over 1,000 photographs, along both axes [cells]

  /// True if the camera has a pixel grid of its own.
  bool own_camera() const { return camera.rows > 0; }

  std::string to_string()
      const;  ///< canonical: "sim:name?size=…&…", only keys that differ from their default (size always)
};

/// fails: unknown_name (scene or key; lists the known ones and the nearest), bad_argument (value out of
/// range); of a given scene as read_dense, and bad_value (negative light, which no camera sees).
Result<SceneUri> parse_scene_uri(std::string_view uri);

/// A scene that `sim:NAME` takes.
struct SceneInfo {
  std::string_view name;
  std::string_view about;  ///< one line
};
/// All scenes, for help and documents. The table is host/src/sim/scenes.cpp.
std::span<const SceneInfo> scenes();
std::span<const std::string_view> scene_names();

/// A key of `sim:NAME?key=value`.
struct SceneKey {
  std::string_view name;
  std::string standard;  ///< its default value
  std::string_view meaning;
  std::string values;  ///< what it can be: "a number from 0 to 0.1"
};
/// All keys, for help and documents. The table is host/src/sim/scene_keys.cpp.
std::span<const SceneKey> scene_keys();

/// The timing and the light of a simulated rig's devices: the values of the key `profile`.
struct RigProfile {
  std::string_view name;
  std::string_view about;      ///< one line
  double refresh_hz = 60;      ///< of the projector: a pattern can begin at each refresh
  double settle_seconds = 0;   ///< from the refresh to the first exposure
  double readout_seconds = 0;  ///< from the end of an exposure to the next one
  double light = 1;            ///< factor on the light: exposures are 1 / light longer
  int planes = 0;              ///< bit planes in each picture; 0: the projector shows whole pictures
  bool overlap = false;        ///< the camera exposes while it reads out the last frame
};
/// All profiles, for help and documents. The table is host/src/sim/rig_profiles.cpp.
std::span<const RigProfile> rig_profiles();

/// The coaxial views that tile the scene's grid.
ViewLayout views_of(const SceneUri& uri);

/// A scene whose T is known: T of the ideal coaxial rig, with psf, but without misalignment, flare, dead
/// pixels and noise. T is exactly symmetric by construction. It is never stored as a matrix. Thread-safe for
/// reading.
class Scene {
 public:
  Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  virtual ~Scene() = default;

  virtual Grid grid() const = 0;
  virtual int channels() const = 0;
  /// y = T p for one channel, raster order. p and y: grid().size() values that do not overlap. p may be
  /// negative, for error metrics.
  virtual void apply(std::span<const float> p, std::span<float> y, int channel) const = 0;

  /// photograph = T · pattern, all channels.
  Image<float> apply(const Image<float>& pattern) const;
};

/// fails: limit (a grid too large for this scene), bad_argument.
Result<std::unique_ptr<Scene>> make_scene(const SceneUri& uri);

}  // namespace symrig
