// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/table_reader.hpp"
#include "symrig/program/program_file.hpp"

namespace symrig::program {

/// The [program] part of a program file, if it is a scan.
void read_scan(base::TableReader& table, Scan& scan);

}  // namespace symrig::program
