// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace symrig::program {

/// A file of host/profiles, copied when the library was built.
struct BuiltinProfile {
  std::string_view name;
  std::string_view text;
};

extern const std::span<const BuiltinProfile> kBuiltinProfiles;

}  // namespace symrig::program
