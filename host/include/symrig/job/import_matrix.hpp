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
/// noise, so what differs is the tensor's error. A tensor of a matrix that is not data-sparse would be no
/// smaller, so it is refused. Algorithm brute does not ask.
/// job.accept: not used.
/// fails: bad_value (not data-sparse; the evidence in one line); as run_job and judge_by_rig.
Result<ImportOutcome> import_matrix(CaptureJob job, OpenedRig& matrix);

}  // namespace symrig
