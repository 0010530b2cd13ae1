// SPDX-License-Identifier: Apache-2.0
// The names of a board's states, in texts and in JSON.
#include "symrig/board/board.hpp"

namespace symrig {

std::string_view name(RunEnd end) {
  switch (end) {
    case RunEnd::completed:
      return "completed";
    case RunEnd::aborted:
      return "aborted";
    case RunEnd::wait_timeout:
      return "wait_timeout";
    case RunEnd::fault:
      return "fault";
    case RunEnd::lost:
      return "lost";
  }
  return "unknown";
}

std::string_view name(BoardState state) {
  switch (state) {
    case BoardState::boot:
      return "boot";
    case BoardState::safe:
      return "safe";
    case BoardState::configured:
      return "configured";
    case BoardState::loaded:
      return "loaded";
    case BoardState::armed:
      return "armed";
    case BoardState::running:
      return "running";
    case BoardState::done:
      return "done";
    case BoardState::fault:
      return "fault";
  }
  return "unknown";
}

std::string_view name(ResetCause cause) {
  switch (cause) {
    case ResetCause::power:
      return "power";
    case ResetCause::pin:
      return "pin";
    case ResetCause::watchdog:
      return "watchdog";
    case ResetCause::request:
      return "request";
  }
  return "unknown";
}

}  // namespace symrig
