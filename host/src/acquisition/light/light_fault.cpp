// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_fault.hpp"

#include <cstddef>
#include <utility>

#include <fmt/format.h>

namespace symrig::acquisition {

Error LightFault::error() const {
  std::string what = measured;
  for (std::size_t k = 0; k < causes.size(); ++k) {
    const char* const before = k > 0 ? "; or " : causes.size() == 1 ? "; cause: " : "; likely causes: ";
    what += before + causes[k].text;
  }
  std::string next = causes.empty() ? std::string() : causes.front().next;
  return {ErrorCode::wrong_light, std::move(what), std::move(next)};
}

std::string percent_of_light(double share) {
  return fmt::format("{:.2g} %", 100 * share);
}

}  // namespace symrig::acquisition
