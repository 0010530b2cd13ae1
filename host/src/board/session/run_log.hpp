// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/receipt.hpp"
#include "symrig/protocol/messages.hpp"

#include <functional>

namespace symrig::board {

/// Collects a run's events in its receipt.
class RunLog {
 public:
  std::function<void(const StepMark&)> on_mark;

  /// Begins the log of a run. `blank` contains the values that are known before the run.
  void open(const Receipt& blank);
  void take(const symrig_wire_Event& event);

  bool finished() const { return finished_; }
  const Receipt& receipt() const { return receipt_; }

 private:
  void take_done(const symrig_wire_RunDone& done);

  Receipt receipt_;
  bool started_ = false;
  bool finished_ = false;
};

/// Converts a fault of the wire; adds its name and hint.
FaultInfo to_fault(const symrig_wire_Fault& fault);

}  // namespace symrig::board
