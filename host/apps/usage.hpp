// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// "there is no command 'captur'; did you mean 'capture'? commands: capture, relight".
std::string no_command(std::string_view word, std::span<const std::string_view> commands);

/// The first word that looks like an option but is unknown, with the nearest known one: "there is no option
/// '--rgi'; did you mean '--rig'?". Nothing if all are known. The parser alone would first report a missing
/// required option.
/// words: what follows the command.
std::optional<std::string> unknown_option(const CLI::App& command, std::span<const std::string> words);

/// "--json is empty": usually an unset variable of a script. Nothing if every option has a value.
std::optional<std::string> empty_value(const CLI::App& command);

}  // namespace symrig::apps
