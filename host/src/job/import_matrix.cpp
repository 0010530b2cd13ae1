// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/import_matrix.hpp"

#include <utility>

namespace symrig {

Result<ImportOutcome> import_matrix(const CaptureJob& job, OpenedRig& matrix) {
  SYMRIG_TRY(CaptureOutcome capture, run_job(job, matrix));
  SYMRIG_TRY(Judged judged, judge_by_rig(capture.result.tensor, *matrix.probe, job.options.progress));
  const double bytes = capture.result.tensor.dense_bytes();
  return ImportOutcome{std::move(capture), std::move(judged), bytes};
}

}  // namespace symrig
