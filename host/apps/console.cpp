// SPDX-License-Identifier: Apache-2.0

#include "console.hpp"

#include "program.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"

#include <cstdlib>

#include <fmt/format.h>
#include <unistd.h>

namespace symrig::apps {

bool takes_colours(int descriptor) {
  const char* const no_colour = std::getenv("NO_COLOR");
  const char* const terminal = std::getenv("TERM");
  const bool refused = no_colour != nullptr && *no_colour != '\0';
  const bool plain = terminal == nullptr || *terminal == '\0' || std::string_view(terminal) == "dumb";
  return !refused && !plain && isatty(descriptor) == 1;
}

std::string coloured(std::string_view text, Colour colour) {
  return fmt::format("\x1b[1;{}m{}\x1b[0m", static_cast<int>(colour), text);
}

Result<void> print(std::string_view text) {
  return write_standard_output(printable(text));
}

void print_error(std::string_view command, std::string_view line) {
  const std::string head = fmt::format("{}{}{}:", program_name(), command.empty() ? "" : " ", command);
  write_standard_error(fmt::format(
      "{} {}\n", takes_colours(STDERR_FILENO) ? coloured(head, Colour::red) : head, printable_line(line)));
}

}  // namespace symrig::apps
