// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/board.hpp"
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
};

struct symrig_rig {
  std::string name, registration;  ///< as given to symrig_rig_open(); empty: a callback
  std::atomic<bool> busy{false};   ///< a call uses the rig
  std::atomic<bool> stop{false};   ///< tells the capture in progress to end
  symrig::OpenedRig opened;        ///< the last member: its devices may ask `stop` until they are closed
};
