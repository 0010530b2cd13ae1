// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/job/capture_job.hpp"
#include "symrig/job/evaluation.hpp"

namespace symrig {

/// A matrix as a tensor.
struct ImportOutcome {
  CaptureOutcome capture;
  Judged judged;            ///< the tensor against the matrix
  double matrix_bytes = 0;  ///< of the matrix, as 32-bit floats
};

/// Captures a matrix (dense_rig.hpp), and then compares the tensor with it under test lights. A matrix has no
/// noise, so what differs is the tensor's error.
/// fails: as run_job and judge_by_rig.
Result<ImportOutcome> import_matrix(const CaptureJob& job, OpenedRig& matrix);

}  // namespace symrig
