// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/program/compile.hpp"

namespace symrig::program {

/// Steps, shortest and longest time, from the records alone; expected becomes the shortest.
void fill_durations(CompiledProgram& compiled);

}  // namespace symrig::program
