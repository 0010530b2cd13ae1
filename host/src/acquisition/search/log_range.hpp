// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace symrig::acquisition {

/// Photographs [first, last) of the log.
struct LogRange {
  std::int64_t first, last;
};

/// What ranges of [0, taken) leave, ascending, without empty ones. left_out: in any order, apart from each
/// other.
std::vector<LogRange> remaining(std::vector<LogRange> left_out, std::int64_t taken);

}  // namespace symrig::acquisition
