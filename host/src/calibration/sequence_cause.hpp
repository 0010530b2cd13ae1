// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::calibration {

/// What may be wrong with a sequence.
struct Cause {
  std::string what;  ///< with what was measured of it
  std::string next;  ///< what to do about it
};

/// The error that names up to three causes, the first ones.  Precondition: there is one.
inline Error error_of(const std::vector<Cause>& causes) {
  constexpr std::size_t kMost = 3;
  if (causes.size() == 1) return {ErrorCode::bad_value, causes.front().what, causes.front().next};
  std::vector<std::string> named;
  for (std::size_t k = 0; k < std::min(causes.size(), kMost); ++k) named.push_back(causes[k].what);
  return {
      ErrorCode::bad_value,
      fmt::format("the photographs contradict each other; possible causes: {}", fmt::join(named, "; or ")),
      causes.front().next};
}

}  // namespace symrig::calibration
