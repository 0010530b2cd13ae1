// SPDX-License-Identifier: Apache-2.0
#include "console.hpp"

#include "symrig/base/printable.hpp"
#include "symrig/base/standard_streams.hpp"

#include <fmt/format.h>

namespace symrig::apps {

Result<void> print(std::string_view text) {
  return write_standard_output(printable(text));
}

void print_error(std::string_view command, std::string_view line) {
  write_standard_error(
      fmt::format("symrig{}{}: {}\n", command.empty() ? "" : " ", command, printable_line(line)));
}

}  // namespace symrig::apps
