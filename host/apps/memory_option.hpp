// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// Adds `--memory SIZE`.
void add_memory(CLI::App& command, std::string& memory);

/// Its bytes; 0 if it is not given.  fails: bad_argument.
Result<std::int64_t> memory_of(const std::string& memory);

}  // namespace symrig::apps
