// SPDX-License-Identifier: Apache-2.0
#include "capi/capture_text.hpp"
#include "capi/guard.hpp"
#include "capi/handles.hpp"
#include "capi/rig_turn.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/job/capture_job.hpp"
#include "symrig/report/made.hpp"

#include <memory>
#include <string>
#include <utility>

namespace {

using namespace symrig;
using namespace symrig::capi;

Result<CaptureJob> capture_job(const symrig_rig& rig, const char* output, const char* options) {
  CaptureJob job;
  if (output != nullptr) job.output = output;
  if (options != nullptr) SYMRIG_CHECK(take_capture_text(options, job));
  job.made = [] { return Made{utc_now(), symrig_version(), "symrig_capture() of C"}; };
  JobFiles files = rig.name.empty() ? JobFiles() : rig_files(rig.name);
  files.reads("the registration", rig.registration).writes("output", job.output, FileFormat::scene);
  if (!job.output.empty()) SYMRIG_CHECK(CaptureLog::declare(job.output, job.log, std::move(files)).check());
  return job;
}

Result<StoredScene> capture_now(symrig_rig& rig, CaptureJob job, Progress progress) {
  job.options.progress = std::move(progress);
  SYMRIG_TRY(CaptureOutcome outcome, run_job(job, rig.opened));
  return StoredScene{std::move(outcome.result.tensor), std::move(outcome.json),
                     std::move(outcome.result.held_out)};
}

}  // namespace

int symrig_capture(symrig_rig* rig, const char* output, const char* options, symrig_on_capture on_progress,
                   void* user, symrig_tensor** tensor, symrig_error* error) {
  return guarded(error, [&] {
    if (tensor != nullptr) *tensor = nullptr;
    if (rig == nullptr) return missing("rig", error);
    const bool writes = output != nullptr && *output != '\0';
    if (tensor == nullptr && !writes) return missing("tensor", error);
    const RigTurn turn(*rig);
    if (const auto free = turn.check(); !free) return report(free.error(), error);
    auto job = capture_job(*rig, output, options);
    if (!job) return report(job.error(), error);
    auto scene = capture_now(*rig, *std::move(job), turn.progress(on_progress, user));
    if (!scene) return report(scene.error(), error);
    if (tensor != nullptr) *tensor = new symrig_tensor{*std::move(scene)};
    return 0;
  });
}
