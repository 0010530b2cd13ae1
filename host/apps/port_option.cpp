// SPDX-License-Identifier: Apache-2.0
#include "port_option.hpp"

#include "numbers.hpp"

#include <fmt/format.h>

namespace symrig::apps {

void add_port(CLI::App& command, std::optional<int>& port) {
  takes_number<int>(
      command.add_option("--port", port, "Serve the page on this port of 127.0.0.1 (default: a free one)")
          ->type_name("PORT"));
}

Result<void> check_port(int port) {
  if (port >= 1 && port <= 65535) return {};
  return Error{ErrorCode::bad_argument, fmt::format("--port {} is not in 1 to 65535", port),
               "remove it for a free port"};
}

}  // namespace symrig::apps
