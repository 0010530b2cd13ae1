// SPDX-License-Identifier: Apache-2.0
#include "symrig/camera/stream_report.hpp"

#include <array>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace symrig {

std::string StreamReport::to_string() const {
  using Count = std::pair<std::uint64_t, std::string_view>;
  std::string text = fmt::format("{} frames", delivered);
  for (const auto& [count, what] :
       {Count{missing, "missing"}, Count{overflowed, "lost because the queue was full"},
        Count{stale, "older than the stream"}, Count{damaged, "damaged"},
        Count{repeated, "with a repeated number"}, Count{reordered, "with a number out of order"},
        Count{unstamped, "without a usable stamp"}, Count{errors, "driver errors"},
        Count{restarts, "restarts"}})
    if (count != 0) text += fmt::format(", {} {}", count, what);
  return text;
}

}  // namespace symrig
