// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/pixel_map.hpp"

#include <array>

namespace symrig::calibration {

/// The working state of decoding: positions of both axes and a mask, camera grid.
struct RawMap {
  std::array<Image<float>, 2> position;  ///< [0] column, [1] row of the projector
  Image<std::uint8_t> mask;

  Grid grid() const { return mask.grid(); }
};

constexpr std::size_t axis_index(StripeAxis axis) {
  return axis == StripeAxis::columns ? 0 : 1;
}

/// A plane through the positions around one camera pixel: position ≈ value + by_col · Δcol + by_row · Δrow.
struct Plane {
  double value = 0, by_col = 0, by_row = 0;
  int support = 0;  ///< number of fitted pixels; 0 = no fit
};

/// Which neighbours are used, and which belong to the same surface.
struct Neighbourhood {
  int reach = 2;     ///< (2 reach + 1)² pixels,
  int spacing = 3;   ///< this many camera pixels apart
  double scale = 1;  ///< typical projector pixels per camera pixel
  int least = 6;     ///< with fewer neighbours there is no plane

  /// A larger step between pixels `distance` apart means another surface (three times the usual slope, and
  /// rounding).
  double largest_step(double distance) const { return 3 * scale * distance + 1.5; }
};

/// Plane through `position` around (row, col), over masked neighbours q with same(q) whose step belongs to
/// the surface. The centre's own value `centre` is the reference of the steps. The centre is used in the fit
/// only if it is masked.
template <class Same>
Plane fit_plane(const Image<float>& position, const Image<std::uint8_t>& mask, int row, int col,
                double centre, const Neighbourhood& hood, Same same);

/// Projector pixels per camera pixel: median over the map.
double typical_scale(const RawMap& map);

/// For each pixel, chooses between the decoded position of `axis` and its reflection inside its block of
/// `block` pixels; see DecodeOptions::held_out_pair. orientation: +1 or −1, the sign of det ∂(col,
/// row)/∂(camera col, camera row). Undecided pixels leave the mask.
void unfold(RawMap& map, StripeAxis axis, int block, double orientation);

/// Share of pixels where the map has this orientation, of those where the orientation is known.
double oriented_share(const RawMap& map, double orientation);

/// Removes pixels from the mask that too few of their neighbours support. The light of a glint or a crumpled
/// foil gives a position, but not one of the surface there. Positions do not change.
void drop_unsupported(RawMap& map, const DecodePolicy& policy);

/// Removes pixels from the mask that see the projector's border from beyond it. Blur lights them, so they get
/// a position on the border. Positions further inside predict where they look: a pixel stays if its own
/// position is at most `distance` [projector pixels] from there. Pixels away from the border stay.
void drop_beyond_border(RawMap& map, const GrayCode& code, double distance);

/// Replaces positions by the value of the local plane, drops pixels without neighbours that agree, and fills
/// small holes where `lit`.
void refine(RawMap& map, const Image<std::uint8_t>& lit);

/// Extends positions from the decoded pixels into the holes between them where `wanted`, by planes of growing
/// neighbourhoods (up to 48 camera pixels away).
void fill_holes(RawMap& map, const Image<std::uint8_t>& wanted);

}  // namespace symrig::calibration

#include "calibration/fit_plane.hpp"
