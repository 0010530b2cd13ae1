// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/calibration/camera_map.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace symrig {

/// The blur of both optics in one part of the picture.
struct TileFocus {
  bool known = false;  ///< enough borders of stripes cross the tile
  double blur = 0;     ///< rms width, without the camera's pixels [cells]
};

/// How camera and projector sit, from a few photographs of wide stripes.
struct Alignment {
  Grid cells, camera;
  bool seen = false;  ///< the camera sees enough stripes; else nothing below is known but `glimpse`
  /// If it sees some: the middle of what it sees, from the middle of the cells [cells].
  std::optional<Point> glimpse;
  MapShape shape;
  std::int64_t edges = 0;  ///< of stripes, which the map was fitted to
  /// The farthest that a pixel looks from its cell, if the camera has a pixel for each cell [cells].
  double offset = 0;
  double cells_seen = 0;             ///< share of the cells that the camera's picture shows
  std::array<TileFocus, 9> focus{};  ///< of 3 × 3 parts of the picture, by rows
  double saturated = 0;              ///< share of the camera's pixels that are brighter than it can measure
  /// Share of the camera's pixels that look at the cells and see no stripes: black parts, and shadows.
  double dark = 0;
  double signal_to_noise = 0;  ///< of the median pixel that sees the stripes, in white light
  std::int64_t photographs = 0;

  bool own_pixels() const { return camera != cells; }
  /// The worst part of the picture [cells].
  double blur() const;
};

/// The patterns: one for each bit of a Gray code of 8 × 8 blocks of cells, white and black: 8. Smaller grids
/// have fewer blocks.
/// fails: limit (fewer than 12 rows or columns of cells).
Result<std::vector<Pattern>> alignment_patterns(Grid cells);

/// The borders of blocks are found between camera pixels, each to a tenth of a pixel, and nothing need be
/// known of the map. A perspective map with distortion is fitted to all of them. A camera that sees no
/// stripes is no error: Alignment::seen. photographs: of alignment_patterns(cells), on the camera's grid.
/// fails: as alignment_patterns; size_mismatch.
Result<Alignment> find_alignment(Grid cells, std::span<const Radiance> photographs);

/// Takes the photographs and finds the alignment. If the camera has a pixel for each cell, pixels on borders
/// do not tell how far it is shifted; then the axis check does (check_coaxial), with 8 photographs more.
/// fails: bad_argument (a rig of several views); wrong_light (the photographs contradict their patterns, or a
/// camera with a pixel for each cell is mirrored or turned); as find_alignment, check_coaxial and the rig.
Result<Alignment> measure_alignment(Probe& rig);

/// Frames of a photograph that are enough to see stripes. A rig that is aligned takes no more, so that it
/// answers several times a second.
inline constexpr int kAlignmentExposures = 2;

/// What must be good for a capture.
enum class AlignmentGoal : std::uint8_t {
  stripes,    ///< the camera sees the stripes
  cells,      ///< it sees all cells
  pixels,     ///< pixels along the side of a cell
  offset,     ///< of a camera with a pixel for each cell
  focus,      ///< blur of the worst part of the picture
  parallax,   ///< from the nearest to the farthest part of the scene
  saturated,  ///< pixels that are too bright
  light,      ///< signal to noise
};

/// What is good enough. docs/howto-rig.md, Align, says what each is from.
struct AlignmentGoals {
  double cells_seen = 1;
  double least_pixels = 2.2;  ///< as RegistrationOptions
  double offset = 0.12;       ///< as CellWeights::largest_shift
  double blur = 0.1;          ///< [cells]
  double parallax = 0.3;      ///< [cells]
  double saturated = 1e-3;
  double signal_to_noise = 20;
};

/// One goal, and how far the rig is from it.
struct AlignmentFinding {
  AlignmentGoal goal = AlignmentGoal::stripes;
  double value = 0, wanted = 0;
  bool good = false;
  /// Cells this many times as large would meet the goal as the rig stands; below 1: so much smaller ones
  /// would do. 0: the size of cells does not matter.
  double cell_factor = 0;
};

/// Compares with the goals, in their order. A camera with a pixel for each cell has no goal for pixels, and
/// others none for the offset.
std::vector<AlignmentFinding> judge(const Alignment& alignment, const AlignmentGoals& goals = {});

/// True if all are good.
bool all_good(const std::vector<AlignmentFinding>& findings);

/// The size of the cells that the alignment allows as it stands, by the present size: the largest
/// AlignmentFinding::cell_factor. 0 if that is not known.
double cell_factor(const std::vector<AlignmentFinding>& findings);

}  // namespace symrig
