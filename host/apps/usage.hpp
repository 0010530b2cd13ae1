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

/// The first word that looks like an option and is none, with the nearest one: "there is no option '--rgi';
/// did you mean '--rig'?". Nothing if all are known. words: what follows the command. The parser itself would
/// first miss the option that was meant.
std::optional<std::string> unknown_option(const CLI::App& command, std::span<const std::string> words);

/// "--json is empty": a variable of a script that nobody has set. Nothing if every value is there.
std::optional<std::string> empty_value(const CLI::App& command);

}  // namespace symrig::apps
