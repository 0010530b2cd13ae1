// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// The completion of bash: a function for bash-completion 2.
std::string bash_completion(const CLI::App& app);

/// The completion of zsh: an autoloaded function.
std::string zsh_completion(const CLI::App& app);

}  // namespace symrig::apps
