// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/hdr/mosaic.hpp"
#include "symrig/tensor/camera_transport.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

struct CameraFitOptions {
  /// Of a camera with a colour mosaic, whose photographs have one channel and whose cells have three. A pixel
  /// has a row in the channel of its own filter only.
  std::optional<BayerPattern> mosaic = {};
  /// Numbers of photographs that the fit must not see, because they judge it.
  std::vector<std::int64_t> held_out = {};
  std::string registration = {};  ///< CameraTransport::Parts::registration
  Progress progress = {};
};

/// Fits the row of T that belongs to each pixel of a camera that is finer than the cells.
///
/// tensor: T on the cells, as the capture found it, symmetric. registration: where the pixels look.
/// photographs: what the camera saw during the capture, on its own pixels. No photograph more is needed: T on
/// the cells says which few numbers describe the row of a pixel, and the photographs tell them. fails:
/// size_mismatch (the three are not of one rig); bad_argument (T is not symmetric); bad_value (no photograph
/// of the flood-lit scene); interrupted; as the log.
Result<CameraTransport> fit_camera(const TransportTensor& tensor, const Registration& registration,
                                   const PhotographLog& photographs, const CameraFitOptions& options = {});

/// How well photographs on the cells must be known, so that each pixel is known well enough for its row.
/// noise_share: variance of a cell as a share of that of its pixels (CellWeights::noise_share).
ExposureGoal goal_of_pixels(const ExposureGoal& goal, double noise_share);

/// Bytes that fit_camera() needs, its result included: about.
std::int64_t camera_fit_bytes(const TransportTensor& tensor, Grid camera, std::int64_t photographs);

}  // namespace symrig
