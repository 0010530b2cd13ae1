// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace symrig {

/// Bytes of memory that programs can still get: what the system states as available (/proc/meminfo), and what
/// the control groups of this process have left. 1 GiB if neither is known.
std::int64_t available_memory();

/// What a job may use if nobody says otherwise: half of available_memory(), as it was when the process first
/// asked. So the same file is treated the same way all the time.
std::int64_t usual_memory();

/// Bytes that the process has in memory now.
std::int64_t resident_memory();

/// Those that belong to no file: they can only leave memory when they are freed.
std::int64_t anonymous_memory();

/// Gives memory back to the system that was freed here, if it is much. malloc keeps it for later, also
/// between other memory where nothing fits. Pages that are used again then cost time, so this is for the end
/// of a stage.
void give_back_freed_memory();

}  // namespace symrig
