// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/device/program_file.hpp"
#include "table_reader.hpp"

namespace symrig::device {

/// The list of steps of a program written by hand.
std::vector<FileStep> read_steps(const TomlNode& list, const std::string& path, ReadContext& context);

}  // namespace symrig::device
