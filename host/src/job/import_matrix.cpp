// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/import_matrix.hpp"

#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

/// The level that tells most against data-sparse transport, or nothing.
std::string evidence_text(const Undetermined& found) {
  const LevelEvidence* most = nullptr;
  for (const LevelEvidence& level : found.levels)
    if (level.tested > 0 && (most == nullptr || level.unexplained > most->unexplained)) most = &level;
  if (most == nullptr) return {};
  return fmt::format("; on level {}, {} of {} nodes are leaves and {:.0f} % of their energy is unexplained",
                     most->level, most->leaves, most->tested, 100 * most->unexplained);
}

Result<void> refuse_not_sparse(const CaptureResult& result) {
  if (!result.undetermined) return {};
  const Undetermined& found = *result.undetermined;
  return Error{ErrorCode::bad_value,
               fmt::format("the matrix is not data-sparse: {} (the search would need at least {} products, "
                           "and the matrix has {} columns{})",
                           found.reason, found.forecast, found.brute_force, evidence_text(found)),
               "algorithm brute stores it column by column"};
}

}  // namespace

Result<ImportOutcome> import_matrix(CaptureJob job, OpenedRig& matrix) {
  job.accept = refuse_not_sparse;
  SYMRIG_TRY(CaptureOutcome capture, run_job(job, matrix));
  SYMRIG_TRY(Judged judged, judge_by_rig(capture.result.tensor, *matrix.probe, job.options.progress));
  const double bytes = capture.result.tensor.dense_bytes();
  return ImportOutcome{std::move(capture), std::move(judged), bytes};
}

}  // namespace symrig
