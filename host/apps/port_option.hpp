// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <optional>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// Adds `--port PORT` of a page that a command serves.
void add_port(CLI::App& command, std::optional<int>& port);

/// fails: bad_argument (no port).
Result<void> check_port(int port);

}  // namespace symrig::apps
