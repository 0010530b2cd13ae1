// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/table_reader.hpp"
#include "symrig/calibration/capture_file.hpp"

namespace symrig {

/// Reads `[sensor]` of a capture file. Errors go to the reader's context.
void read_sensor_files(base::TableReader& top, CaptureFile& file);

}  // namespace symrig
