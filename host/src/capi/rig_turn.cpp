// SPDX-License-Identifier: Apache-2.0
#include "capi/rig_turn.hpp"

#include <string>

namespace symrig::capi {
namespace {

/// The callback may be C++. What it throws stops the call.
bool goes_on(symrig_on_capture told, void* user, const ProgressEvent& event) {
  const std::string stage(event.stage);
  const symrig_capture_progress at{stage.c_str(), event.done, event.expected};
  try {
    return told(&at, user) == 0;
  } catch (...) {
    return false;
  }
}

}  // namespace

Result<void> RigTurn::check() const {
  if (taken_) return {};
  return Error{ErrorCode::bad_argument, "another call uses the rig", "wait until it is done"};
}

Progress RigTurn::progress(symrig_on_capture on_progress, void* user) const {
  return [&rig = rig_, on_progress, user](const ProgressEvent& event) {
    return !rig.stop && (on_progress == nullptr || goes_on(on_progress, user, event));
  };
}

}  // namespace symrig::capi
