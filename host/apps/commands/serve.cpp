// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "console.hpp"
#include "meter.hpp"
#include "symrig/board/board_server.hpp"

#include <memory>
#include <string>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct ServeArguments {
  std::string device, place;
};

Result<void> run(const ServeArguments& arguments) {
  SYMRIG_TRY(BoardServer server, BoardServer::open(arguments.device, arguments.place));
  SYMRIG_CHECK(
      print(fmt::format("{}\nA simulated board answers at this address. Ctrl-C ends.\n", arguments.place)));
  server.run([] { return !interrupted(); });
  return {};
}

}  // namespace

Job add_serve(CLI::App& command) {
  const auto arguments = std::make_shared<ServeArguments>();
  command.add_option("device", arguments->device, "The simulated board: sim: or sim:?jumper=OUT:IN")
      ->required()
      ->type_name("sim:");
  command
      .add_option("--listen", arguments->place, "Where it answers: a local socket, or a port of this machine")
      ->required()
      ->type_name("unix:PATH|tcp:127.0.0.1:PORT");
  command.footer(
      std::string("Example:\n"
                  "  symrig serve sim: --listen unix:/tmp/board.sock\n"
                  "  symrig info --device unix:/tmp/board.sock\n"
                  "\n"
                  "For people who write a host of their own. The board runs the real firmware, and its clock "
                  "follows real time.\n"
                  "It speaks the bytes of protocol/PROTOCOL.md with one host after the other.\n"
                  "\n") +
      kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
