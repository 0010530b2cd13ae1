// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/receipt.hpp"
#include "symrig/protocol/messages.hpp"

#include <functional>

namespace symrig::board {

/// Gathers a run's events into its receipt.
class RunLog {
 public:
  std::function<void(const StepMark&)> on_mark;

  /// A run is about to start: `blank` carries what is known beforehand.
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

/// A fault of the wire in words.
FaultInfo to_fault(const symrig_wire_Fault& fault);

}  // namespace symrig::board
