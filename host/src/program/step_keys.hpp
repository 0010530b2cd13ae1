// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/table_reader.hpp"
#include "symrig/program/program_file.hpp"

namespace symrig::program {

/// Reads the list of steps of a program with steps.
std::vector<FileStep> read_steps(const base::TomlNode& list, const std::string& path,
                                 base::ReadContext& context);

}  // namespace symrig::program
