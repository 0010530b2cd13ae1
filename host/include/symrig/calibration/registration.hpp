// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/calibration/camera_map.hpp"
#include "symrig/calibration/camera_optics.hpp"
#include "symrig/calibration/cell_weights.hpp"
#include "symrig/camera/frame_format.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/outline.hpp"

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig {

/// How far the camera's picture of the cells is from where it was.
struct Motion {
  double row = 0, col = 0;  ///< [cells]
  double sigma = 0;         ///< standard deviation of each, by the photographs' noise [cells]
  double brightness = 1;    ///< lamp and exposure, relative to then

  double distance() const;
};

/// Notices that a registered rig has moved. It compares photographs of two stripe patterns with those of the
/// registration: a picture that moved by d changed by d · ∇ of the picture. Edges of stripes are sharper than
/// the camera's pixels, so the distance is right within a third; 0 is exact.
class MotionWatch {
 public:
  /// Stripes two cells wide, then the same across.
  static std::array<Pattern, 2> patterns(Grid cells);

  /// before: means of the photographs of both patterns, one after the other: 2 · channels planes.
  /// step: CameraMap::step(). mosaic: the camera's colour filters. Pixels of one colour are two pixels apart.
  MotionWatch(Grid cells, Image<float> before, std::array<Point, 2> step, Mosaic mosaic = Mosaic::none)
      : cells_(cells), before_(std::move(before)), step_(step), mosaic_(mosaic) {}

  /// Exposures make a motion known to this [cells]: three of it are a third of the motion that a capture
  /// allows.
  static constexpr double kSigma = 0.0005;

  /// Takes two photographs; again, as the rig chooses, where they came out too bright.
  /// fails: as the rig; size_mismatch; bad_value (the pictures have no edges).
  Result<Motion> measure(Probe& rig) const;
  /// now: photographs of patterns().
  /// fails: as measure(), without the rig.
  Result<Motion> compare(std::span<const Radiance> now) const;
  Mosaic mosaic() const { return mosaic_; }

 private:
  Result<void> check(std::span<const Radiance> now) const;
  template <class Add>
  void for_each_slope(Add add) const;
  std::vector<Expectation> expected() const;
  double cells_of(double pixels) const;

  Grid cells_;
  Image<float> before_;
  std::array<Point, 2> step_;
  Mosaic mosaic_;
};

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

/// The relative error of `indirect` that a capture with a registration will have, apart from its tolerance.
struct ExpectedIndirect {
  double surfaces = 0;    ///< of opaque, matt scenes: within a factor of 2
  double scattering = 0;  ///< of translucent scenes and mirrors: at most about this
};

/// What pixels on the borders of cells cannot tell, by the number p of camera pixels along the side of a
/// cell: 0.22 / p on surfaces, where the error is that of cells next to lit ones; 1.1 / p² where light
/// spreads inside a cell. nullopt: the pixels do not keep clear of borders (Weighting::cores), so the cells
/// of a coaxial rig with the same blur err as much; or there are several views, which err more. source:
/// measured on simulated benches of 2.25 to 6 pixels (docs/research/registration.md, Camera pixels along
/// the side of a cell).
std::optional<ExpectedIndirect> expected_indirect(const Registration& registration, ViewLayout views);

/// Writes registration.h5 (HDF5, docs/registration-file.md) atomically.
/// fails: io, not_found.
Result<void> save_registration(const std::filesystem::path& path, const Registration& registration);

/// Reads registration.h5. Checks version, sizes and every number before it uses them.
/// fails: not_found, io, bad_format, bad_value.
Result<Registration> load_registration(const std::filesystem::path& path);

}  // namespace symrig
