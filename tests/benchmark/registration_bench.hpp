// SPDX-License-Identifier: Apache-2.0
// A bench that was aligned by hand, its capture, and how wrong its maps are: for registration.cpp.
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/calibration/registered_probe.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::benchmark {

/// Four camera pixels along the side of a cell at zoom 1, turn, zoom, shift, distortion. The camera is larger
/// than the cells, so that it sees all of them.
inline std::string bench_of(int size, double moved = 0) {
  const int camera = static_cast<int>(std::lround(size * 3.72 + 66));
  return fmt::format("&camera={0}x{0}&turn=1.5&zoom={1:.4f}&shift={2},-4.1&distortion=0.02", camera,
                     3.72 * size / camera, 7.3 + moved);
}

struct Captured {
  double patterns = 0;
  TransportErrors errors;
  TransportErrors estimated, half_width;  ///< by the capture itself
  GainMismatch gain;
};

inline Result<Captured> captured(Probe& probe, const TrueTransport& truth) {
  SYMRIG_TRY(const CaptureResult result, capture(probe, {}));
  SYMRIG_TRY(const TransportErrors errors, evaluate(result.tensor, truth));
  return Captured{static_cast<double>(result.patterns), errors, result.estimated.value_or(TransportErrors{}),
                  result.estimated_half_width, result.gain_mismatch};
}

/// A corner of a camera pixel that looks at a cell: where, and how far off a map is there [cells].
struct CornerError {
  Point at, off;
};

inline std::vector<CornerError> corner_errors(const CameraMap& found, const CornerMap& exact, Grid cells) {
  const CornerMap map = found.corners();
  std::vector<CornerError> errors;
  for (int row = 0; row < exact.grid().rows; ++row)
    for (int col = 0; col < exact.grid().cols; ++col) {
      const Point at{exact.at(row, col, 0), exact.at(row, col, 1)};
      if (at.row < 0 || at.col < 0 || at.row >= cells.rows || at.col >= cells.cols) continue;
      errors.push_back({at, {map.at(row, col, 0) - at.row, map.at(row, col, 1) - at.col}});
    }
  return errors;
}

/// rms along an axis [cells].
inline double rms(std::span<const CornerError> errors) {
  double square = 0;
  for (const CornerError& e : errors) square += (e.off.row * e.off.row + e.off.col * e.off.col) / 2;
  return std::sqrt(square / static_cast<double>(errors.size()));
}

/// The mean of each tile of 8 × 8 cells: what is left over of a shift.
inline std::vector<CornerError> tile_means(std::span<const CornerError> errors, Grid cells) {
  constexpr int kTile = 8;
  const int across = (cells.cols + kTile - 1) / kTile;
  std::vector<CornerError> sums(static_cast<std::size_t>(across) * ((cells.rows + kTile - 1) / kTile));
  std::vector<double> counts(sums.size());
  for (const CornerError& e : errors) {
    const std::size_t tile = static_cast<int>(e.at.row) / kTile * across + static_cast<int>(e.at.col) / kTile;
    sums[tile].off.row += e.off.row, sums[tile].off.col += e.off.col, ++counts[tile];
  }
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const double count = std::max(counts[k], 1.0);
    sums[k].off.row /= count, sums[k].off.col /= count;
  }
  return sums;
}

/// Of the worst channel [cells].
struct MapError {
  double corners = 0, tiles = 0;
};

inline MapError map_error(const Registration& found, const std::vector<CornerMap>& exact) {
  MapError worst;
  for (std::size_t c = 0; c < found.maps.size(); ++c) {
    const auto errors = corner_errors(found.maps[c], exact[exact.size() == 1 ? 0 : c], found.cells);
    worst.corners = std::max(worst.corners, rms(errors));
    worst.tiles = std::max(worst.tiles, rms(tile_means(errors, found.cells)));
  }
  return worst;
}

/// A rig, its registered probe, and what its camera cannot know better.
struct Compared {
  std::string ideal;  ///< keys of the rig to compare with
  std::string bench;  ///< keys of the bench
  bool own = false;   ///< each rig is judged by its own T, not by that of the ideal coaxial rig
};

/// T of the ideal coaxial rig, or that of this rig.
inline Result<TrueTransport> truth_of(const VirtualRig& rig, bool own) {
  if (!own)
    return TrueTransport(
        [&rig](const Image<float>& p) -> Result<Image<float>> { return rig.truth().apply(p); });
  SYMRIG_TRY(auto bench, bench_truth(rig.uri()));
  if (bench) return *std::move(bench);
  return TrueTransport(
      [&rig](const Image<float>& p) -> Result<Image<float>> { return rig.ideal_photograph(p); });
}

/// Captures a bench with a registration of it.
/// moved: what the registration is told of its error [cells]; none: nothing but its own.
inline Result<Captured> captured_registered(VirtualRig& rig, const Registration& registration, bool own,
                                            double moved = 0) {
  SYMRIG_TRY(CellWeights weights, registration.weights());
  RegisteredProbe probe(rig, std::move(weights), std::hypot(registration.error(), moved));
  SYMRIG_TRY(const TrueTransport truth, truth_of(rig, own));
  return captured(probe, truth);
}

}  // namespace symrig::benchmark
