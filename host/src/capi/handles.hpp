// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/board/board.hpp"
#include "symrig/job/relight.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/symrig.h"
#include "symrig/tensor/file.hpp"

#include <atomic>
#include <mutex>
#include <optional>
#include <string>

// The opaque handles of symrig.h. A program has exactly one of the two values.
struct symrig_program {
  std::optional<symrig::ProgramFile> file;
  std::optional<symrig::CompiledProgram> compiled;

  symrig::RigWiring wiring() const { return file ? symrig::wiring_of(file->rig) : compiled->wiring; }
  symrig::Nanoseconds keep_alive() const { return file ? file->rig.keep_alive : compiled->keep_alive; }
};

struct symrig_board {
  explicit symrig_board(symrig::Board connected) : board(std::move(connected)) {}

  std::mutex mutex;  ///< held by the thread that talks to the board
  symrig::Board board;
  std::atomic<bool> stop{false};  ///< tells the run that holds the mutex to end
};

struct symrig_tensor {
  symrig::StoredScene scene;
  std::optional<symrig::Relighter> camera = {};  ///< of a scene with the camera's own pixels

  static symrig::Result<symrig_tensor*> make(symrig::StoredScene scene);  ///< the caller deletes it
};

struct symrig_rig {
  std::string name, registration;  ///< as given to symrig_rig_open(); empty: a callback
  std::atomic<bool> busy{false};   ///< a call uses the rig
  std::atomic<bool> stop{false};   ///< tells the capture in progress to end
  symrig::OpenedRig opened;        ///< the last member: its devices may ask `stop` until they are closed
};

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
