// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/device/program_file.hpp"
#include "table_reader.hpp"

namespace symrig::device {

/// The [program] part of a program file, if it is a scan.
void read_scan(TableReader& table, Scan& scan);

}  // namespace symrig::device
