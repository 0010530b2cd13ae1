// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/pixel_map.hpp"

#include <array>

namespace symrig::calibration {

/// What decoding works on: positions of both axes and a mask, camera grid.
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
  int support = 0;  ///< pixels it was fitted to; 0 = none could be
};

/// Which neighbours are looked at, and which belong to the same surface.
struct Neighbourhood {
  int reach = 2;     ///< (2 reach + 1)² pixels,
  int spacing = 3;   ///< this many camera pixels apart
  double scale = 1;  ///< typical projector pixels per camera pixel
  int least = 6;     ///< fewer neighbours than this: no plane

  /// A step this large between pixels `distance` apart is another surface (three times the usual slope, and
  /// rounding).
  double largest_step(double distance) const { return 3 * scale * distance + 1.5; }
};

/// Plane through `position` around (row, col), over masked neighbours q with same(q) and a step that belongs
/// to the surface. The centre's own value `centre` judges the steps; it takes part only if it is masked.
template <class Same>
Plane fit_plane(const Image<float>& position, const Image<std::uint8_t>& mask, int row, int col,
                double centre, const Neighbourhood& hood, Same same);

/// Projector pixels per camera pixel: median over the map.
double typical_scale(const RawMap& map);

/// Chooses, for each pixel, between the decoded position of `axis` and its reflection inside its block of
/// `block` pixels; see DecodeOptions::held_out_pair. orientation: +1 or −1, the sign of det ∂(col,
/// row)/∂(camera col, camera row). Pixels that cannot be settled leave the mask.
void unfold(RawMap& map, StripeAxis axis, int block, double orientation);

/// Share of pixels around which the map keeps this orientation, of those where it can be told.
double oriented_share(const RawMap& map, double orientation);

/// Takes pixels out of the mask that few of their neighbours agree with: what a glint or a crumpled foil
/// sends is a position, but not one of the surface there. Positions stay as they are.
void drop_unsupported(RawMap& map, const DecodePolicy& policy);

/// Replaces positions by the local plane's value, drops pixels without neighbours that agree, fills small
/// holes where `lit`.
void refine(RawMap& map, const Image<std::uint8_t>& lit);

/// Carries positions from the decoded pixels into the holes between them where `wanted`, by planes of growing
/// neighbourhoods (up to 48 camera pixels away).
void fill_holes(RawMap& map, const Image<std::uint8_t>& wanted);

}  // namespace symrig::calibration

#include "calibration/fit_plane.hpp"
