// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/calibration/camera_map.hpp"
#include "symrig/calibration/cell_weights.hpp"
#include "symrig/calibration/gain_ratio.hpp"
#include "symrig/calibration/ghost.hpp"
#include "symrig/calibration/map_shape.hpp"
#include "symrig/calibration/motion_watch.hpp"
#include "symrig/calibration/optics_blur.hpp"

#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// What reciprocity found in the map of a blurred rig, rms along an axis [cells].
struct ReciprocalShift {
  double corrected = 0;  ///< by how much the map was changed
  double left = 0;       ///< what is not known of it
  bool measured = false;
};

/// How a camera with pixels of its own sees the projector's cells.
struct Registration {
  Grid cells;
  std::vector<CameraMap> maps;  ///< one for each channel
  /// The flood-lit scene on the camera's grid: the mean of white and of all patterns with their complements,
  /// so its noise is that of many photographs. A ghost is still in it.
  Radiance flood;
  /// Of a camera with a pixel for each cell: pixel (i, j) sees what is at (i, j) + shift [cells].
  std::optional<Point> shift;
  /// Of CellWeights::make: two for each map.
  Image<float> shares;
  Image<float> stripes;  ///< photographs of MotionWatch::patterns(): 2 · channels planes
  /// Subtracted from each photograph before it becomes cells.
  CameraGhost ghost;
  GainRatio gain;
  /// Measured only if the borders of cells are blurred in the picture. Light that scatters below the surface
  /// is no blur of the optics.
  OpticsBlur blur;
  ReciprocalShift reciprocity;
  std::int64_t photographs = 0;  ///< that it took
  std::string rig;               ///< as it describes itself

  /// Of each map.
  std::vector<CornerMap> corners() const;
  /// Compares the rig with what it was. mosaic: the colour filters of its camera.
  MotionWatch watch(Mosaic mosaic = Mosaic::none) const;
  Grid camera() const { return flood.mean.grid(); }
  /// The map of the middle channel, in plain words.
  MapShape shape() const;
  /// rms error of the worst channel's map [cells].
  double error() const;
  /// Camera pixels along the side of a cell, the fewest of all channels.
  double pixels_per_cell() const;
  /// rms blur of both optics together, by the width of edges [cells].
  double edge_blur() const;
  /// Cores if the optics are sharp. Blurred light crosses the borders of cells anyway, so then by area.
  Weighting weighting() const;
  /// The weights without gain ratio and blur. A ghost is subtracted.
  Result<CellWeights> bare_weights() const;
  /// How far weights keep from the borders of cells: three times the error of the map [cells].
  double margin() const;
  /// What brings photographs to the cells, with gain ratio and blur corrected.
  /// fails: as CellWeights::make; bad_value (the blurs are too different).
  Result<CellWeights> weights() const;
  /// The same in three colours, for a camera with a colour mosaic that was registered as one channel.
  /// fails: also bad_argument (more than one map, a ghost, unequal blurs, or a camera with a pixel for each
  /// cell: they would mix the colours).
  Result<CellWeights> weights_of_mosaic(const BayerPattern& filters) const;
};

struct RegistrationOptions {
  /// A camera with fewer pixels along the side of a cell is refused. With 2.2, every cell has a pixel that
  /// lies wholly inside it, however the camera is turned.
  double least_pixels = 2.2;
  /// [cells] Wider edges are refused. The finest stripes are two cells wide: then they run into each other,
  /// and the map is wrong by more than it states (docs/research/registration.md, Blur).
  double widest_edge = 1.3;
  /// Correct the map of a blurred rig by reciprocity.
  bool refine = true;
  Progress progress = {};
};

/// Registers the camera of a rig.
///
/// A Gray code of the cells finds where a camera with more pixels than cells looks. A camera with a pixel
/// for each cell is registered by the axis check instead, if it is shifted by at most
/// CellWeights::largest_shift. Photographs: 2 (bits of columns + bits of rows) + 2 for the map, so 26 for
/// 64 x 64 cells; 6 for a ghost; 2 to notice motion; 16 for the gain ratio; and 8 for the blurs of a picture
/// that is not sharp. A ghost is subtracted from the photographs, and the map fitted again. The photographs
/// for the blurs also show by reciprocity where the map is wrong, and it is corrected until nothing is left
/// above their noise. A rig of several views shows its Gray code in one view after another, because a point
/// is lit from all of them; a ghost and blurs are those of the view in the middle. If such a rig has a pixel
/// for each cell, they are not looked for. fails: as fit_camera_maps and check_coaxial; bad_value (no map of
/// the views; the map is too uncertain, or the picture out of focus); limit (the camera is too coarse, and
/// the message says which cells would do; or shifted too far); interrupted; as the rig.
Result<Registration> register_camera(Probe& rig, const RegistrationOptions& options = {});

/// [cells] From the nearest to the farthest part. At twice the parallax of the scenes that lose nothing,
/// light from far cells errs twice as much (docs/research/registration.md, Parallax).
inline constexpr double kMostParallax = 1;

/// Whether an algorithm may take T to be symmetric.
/// fails: bad_value (camera and projector look from two places: Parallax::range above kMostParallax).
Result<void> require_coaxial(const Parallax& parallax);

}  // namespace symrig
