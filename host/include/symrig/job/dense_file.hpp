// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/job/capture_job.hpp"
#include "symrig/job/evaluation.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <filesystem>

namespace symrig {

/// Writes T as a matrix of 32-bit floats, atomically. The suffix chooses the format:
/// - .npy: [camera pixel × projector pixel] in raster order; a rig of dense_rig.hpp reads it.
/// - .mat (MATLAB's level 4, which Octave reads too): T for pictures that MATLAB stores, column after column,
/// so
///   photograph = reshape(T * light(:), photo_size); and light_size, photo_size, each [rows cols].
/// error: as TransportTensor::apply of one pixel.
/// fails: bad_argument (another suffix; several channels), limit (more than max_bytes), interrupted,
/// not_found, io.
Result<void> save_dense(const std::filesystem::path& path, const TransportTensor& tensor,
                        std::int64_t max_bytes, const Progress& progress);

/// A matrix as a tensor.
struct ImportOutcome {
  CaptureOutcome capture;
  Judged judged;            ///< the tensor against the matrix
  double matrix_bytes = 0;  ///< of the matrix, as 32-bit floats
};

/// Captures a matrix (dense_rig.hpp), and then compares the tensor with it under test lights. A matrix has no
/// noise, so what differs is the tensor's error. A tensor of a matrix that is not data-sparse would be no
/// smaller, so it is refused. Algorithm brute does not ask.
/// job.accept: not used.
/// fails: bad_value (not data-sparse; the evidence in one line); as run_job and judge_by_rig.
Result<ImportOutcome> import_matrix(CaptureJob job, OpenedRig& matrix);

}  // namespace symrig
