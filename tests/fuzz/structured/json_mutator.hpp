// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/random.hpp"

#include <string>

namespace symrig::structured {

/// The JSON text with one to three of its values changed: another number, another kind of value, an entry
/// gone, doubled, or nested deeply. The result is JSON.
std::string mutate_json(const std::string& text, Random& random);

/// Any text: JSON as above; else cut, lengthened, or replaced. May not be JSON any more.
std::string mutate_text(const std::string& text, Random& random);

}  // namespace symrig::structured
