// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace symrig {

/// Edits from a to b: insert, delete or replace one letter, or exchange two neighbours.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known name that somebody meant who wrote `given`: it differs by a third of its letters at most, or one
/// is a part of the other. Capital letters count as small ones. Nothing where no name is as near as that: a
/// guess that is far off misleads.
std::optional<std::string_view> nearest_name(std::string_view given, std::span<const std::string_view> known);

/// "did you mean 'gain'? ", or nothing.
std::string suggestion(std::string_view given, std::span<const std::string_view> known);

/// The next step after a name that is none: "did you mean 'gain'? known: gain, exposure"; "there are none"
/// where nothing is known.
std::string nearest_hint(std::string_view given, std::span<const std::string_view> known);
std::string nearest_hint(std::string_view given, std::span<const std::string> known);

/// "gain, exposure".
std::string listed(std::span<const std::string_view> names);

}  // namespace symrig
