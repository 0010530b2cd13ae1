// SPDX-License-Identifier: Apache-2.0
#include "capi/capture_text.hpp"
#include "capi/guard.hpp"
#include "capi/handles.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/job/capture_job.hpp"
#include "symrig/report/made.hpp"

#include <memory>
#include <string>

namespace {

using namespace symrig;
using namespace symrig::capi;

/// A rig works for one call at a time. A callback that uses its own rig would wait for itself.
class RigTurn {
 public:
  explicit RigTurn(symrig_rig& rig) : rig_(rig), taken_(!rig.busy.exchange(true)) {
    if (taken_) rig_.stop = false;  // set during an earlier capture
  }
  RigTurn(const RigTurn&) = delete;
  RigTurn& operator=(const RigTurn&) = delete;
  ~RigTurn() {
    if (taken_) rig_.busy = false;
  }

  bool taken() const { return taken_; }

 private:
  symrig_rig& rig_;
  bool taken_;
};

/// The callback may be C++. What it throws stops the capture.
bool goes_on(symrig_on_capture told, void* user, const ProgressEvent& event) {
  const std::string stage(event.stage);
  const symrig_capture_progress at{stage.c_str(), event.done, event.expected};
  try {
    return told(&at, user) == 0;
  } catch (...) {
    return false;
  }
}

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

Result<StoredScene> capture_now(symrig_rig& rig, CaptureJob job, symrig_on_capture on_progress, void* user) {
  job.options.progress = [&rig, on_progress, user](const ProgressEvent& event) {
    return !rig.stop && (on_progress == nullptr || goes_on(on_progress, user, event));
  };
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
    if (!turn.taken())
      return report({ErrorCode::bad_argument, "another call uses the rig", "wait until it is done"}, error);
    auto job = capture_job(*rig, output, options);
    if (!job) return report(job.error(), error);
    auto scene = capture_now(*rig, *std::move(job), on_progress, user);
    if (!scene) return report(scene.error(), error);
    if (tensor != nullptr) *tensor = new symrig_tensor{*std::move(scene)};
    return 0;
  });
}
