// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/log_range.hpp"

#include <algorithm>

namespace symrig::acquisition {

std::vector<LogRange> remaining(std::vector<LogRange> left_out, std::int64_t taken) {
  std::sort(left_out.begin(), left_out.end(), [](LogRange a, LogRange b) { return a.first < b.first; });
  std::vector<LogRange> ranges;
  std::int64_t next = 0;
  for (const LogRange& out : left_out) {
    if (out.first > next) ranges.push_back({next, out.first});
    next = out.last;
  }
  if (taken > next) ranges.push_back({next, taken});
  return ranges;
}

}  // namespace symrig::acquisition
