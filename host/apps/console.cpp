// SPDX-License-Identifier: Apache-2.0
#include "console.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>

namespace symrig::apps {

Result<void> print(std::string_view text) {
  const bool done =
      std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
  if (done) return {};
  return Error{ErrorCode::io, fmt::format("standard output cannot be written ({})", std::strerror(errno)),
               "check what it is connected to"};
}

void print_error(std::string_view command, std::string_view line) {
  std::string clean(line);
  std::replace_if(
      clean.begin(), clean.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  fmt::print(stderr, "symrig{}{}: {}\n", command.empty() ? "" : " ", command, clean);
}

}  // namespace symrig::apps
