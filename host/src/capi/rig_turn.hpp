// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "capi/handles.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"

namespace symrig::capi {

/// A rig works for one call at a time. A callback that uses its own rig would wait for itself.
class RigTurn {
 public:
  explicit RigTurn(symrig_rig& rig) : rig_(rig), taken_(!rig.busy.exchange(true)) {
    if (taken_) rig_.stop = false;  // set during an earlier call
  }
  RigTurn(const RigTurn&) = delete;
  RigTurn& operator=(const RigTurn&) = delete;
  ~RigTurn() {
    if (taken_) rig_.busy = false;
  }

  /// fails: bad_argument (another call uses the rig).
  Result<void> check() const;
  /// Tells on_progress (may be null). It stops if that or symrig_rig_stop() says so.
  Progress progress(symrig_on_capture on_progress, void* user) const;

 private:
  symrig_rig& rig_;
  bool taken_;
};

}  // namespace symrig::capi
