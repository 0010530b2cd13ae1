// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/alignment/coarse_code.hpp"
#include "calibration/camera_map/perspective_map.hpp"
#include "symrig/calibration/alignment.hpp"

#include <array>
#include <span>

namespace symrig::calibration {

/// The blur of both optics, from the light of pixels on both sides of each edge.
///
/// The light of a pixel at the distance d from the edge, as a share of white light, is a + b S(d). S is an
/// edge that blur of rms width σ and the width w of a pixel spread:
///
///   S(d) = (G(d + w/2) − G(d − w/2)) / w,   G(x) = x Φ(x/σ) + σ φ(x/σ)
///
/// a and b contain the light from elsewhere in the scene. σ is the one with the least squares over all pixels
/// up to two cells away.
class EdgeFocus {
 public:
  EdgeFocus(const CoarseCode& code, const CoarsePixels& pixels, const PerspectiveMap& map)
      : code_(code), pixels_(pixels), map_(map) {}
  std::array<TileFocus, 9> measure(std::span<const CoarseEdge> edges) const;

 private:
  struct Profile;
  void add(const CoarseEdge& edge, Profile& profile) const;

  const CoarseCode& code_;
  const CoarsePixels& pixels_;
  const PerspectiveMap& map_;
};

}  // namespace symrig::calibration
