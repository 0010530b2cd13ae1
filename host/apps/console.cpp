// SPDX-License-Identifier: Apache-2.0
#include "console.hpp"

#include "colour.hpp"
#include "program.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"

#include <fmt/format.h>
#include <unistd.h>

namespace symrig::apps {

Result<void> print(std::string_view text) {
  return write_standard_output(printable(text));
}

void print_error(std::string_view command, std::string_view line) {
  const std::string head = fmt::format("{}{}{}:", program_name(), command.empty() ? "" : " ", command);
  write_standard_error(fmt::format(
      "{} {}\n", takes_colours(STDERR_FILENO) ? coloured(head, Colour::red) : head, printable_line(line)));
}

}  // namespace symrig::apps
