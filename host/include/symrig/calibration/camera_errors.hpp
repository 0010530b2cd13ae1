// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/outline.hpp"
#include "symrig/tensor/camera_transport.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace symrig {

/// Which cells the pixels of a camera see directly. A sample is a pixel in a channel.
class SeenCells {
 public:
  /// corners: a map of the camera, or one for each channel.
  SeenCells(const CameraTransport& camera, std::span<const CornerMap> corners);

  /// 1 for each sample [channel][pixel] that has a row of T, and sees nothing beside the cells.
  const std::vector<char>& counted() const { return counted_; }
  /// The same without those that see a cell that is not 0 in `lit`, or that are less than a tenth of a cell
  /// away from it: the map of a registration errs less, so all maps give the same samples but for a few.
  std::vector<char> dark(const Image<float>& lit) const;
  /// The cell in its middle.  channel, pixel: of a sample that counts.
  std::int32_t cell(std::int32_t channel, std::int64_t pixel) const;

 private:
  struct Box {
    std::int16_t top = 0, left = 0, bottom = -1, right = -1;  // cells, all included
  };
  Box box_of(const CornerMap& corners, int row, int col, double margin) const;
  const std::vector<Box>& boxes(std::int32_t channel) const {
    return boxes_[boxes_.size() == 1 ? 0 : channel];
  }

  Grid cells_;
  std::vector<std::vector<Box>> boxes_;  // of each map
  std::vector<char> counted_;
};

/// What held-out photographs tell of T on the camera's pixels.
struct CameraErrors {
  ErrorEstimate estimate;
  std::vector<float> chi_square;  ///< of each row: CameraTransport::Parts::chi_square
  /// Rows whose pixel is dead or clipped in a held-out photograph that lights it. The estimate holds them in
  /// part: not in the error of the flood-lit scene.
  std::int64_t unjudged = 0;
};

/// The errors of T on the camera's pixels, estimated from photographs that the fit did not see.
///
/// held_out: their numbers in the log, as CaptureResult::held_out_at. noise: of the capture. The estimates
/// are those of cells (docs/research/error-estimates.md), of other samples. Two things are left out, because
/// the rows are not symmetric: a mismatch of gains, and light to one side. fails: as the log; interrupted.
Result<CameraErrors> estimate_camera_errors(const CameraTransport& camera, const SeenCells& seen,
                                            const PhotographLog& log, std::span<const std::int64_t> held_out,
                                            const NoiseCheck& noise, const Progress& progress = {});

}  // namespace symrig
