// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/program/compile.hpp"

namespace symrig::program {

/// Computes steps, shortest and longest time from the records alone. Sets `expected` to the shortest.
void fill_durations(CompiledProgram& compiled);

}  // namespace symrig::program
