// SPDX-License-Identifier: Apache-2.0
#include "effects.hpp"

#include <fmt/format.h>

namespace symrig::apps {

Result<void> check_effects(const CLI::App& command, std::span<const Idle> options) {
  for (const Idle& one : options)
    if (one.idle && command.count(one.option) > 0)
      return Error{ErrorCode::bad_argument, fmt::format("{} has no effect {}", one.option, one.why),
                   "remove it"};
  return {};
}

}  // namespace symrig::apps
