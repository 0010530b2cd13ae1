// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace symrig {

/// Edits (insert, delete, replace one letter) from a to b.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The next step after a name that is none: "did you mean 'gain'? known: gain, exposure"; "there are none"
/// where nothing is known.
std::string nearest_hint(std::string_view given, std::span<const std::string_view> known);
std::string nearest_hint(std::string_view given, std::span<const std::string> known);

}  // namespace symrig
