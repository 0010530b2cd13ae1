// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "console.hpp"
#include "meter.hpp"
#include "symrig/board/board_server.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/rig/photograph_server.hpp"

#include <memory>
#include <string>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct ServeArguments {
  std::string device, place;
  bool photographs = false;
};

Result<void> tell(const ServeArguments& arguments, const char* what) {
  return print(fmt::format("{}\n{} at this address. Ctrl-C ends.\n", arguments.place, what));
}

Result<void> serve_board(const ServeArguments& arguments) {
  SYMRIG_TRY(BoardServer server, BoardServer::open(arguments.device, arguments.place));
  SYMRIG_CHECK(tell(arguments, "A simulated board answers"));
  server.run([] { return !interrupted(); });
  return {};
}

Result<void> serve_photographs(const ServeArguments& arguments) {
  const auto open = [rig = arguments.device]() -> Result<std::unique_ptr<Probe>> {
    SYMRIG_TRY(auto simulated, open_simulated_rig(rig));
    return std::unique_ptr<Probe>(std::move(simulated));
  };
  SYMRIG_TRY(PhotographServer server, PhotographServer::open(open, arguments.place));
  SYMRIG_CHECK(tell(arguments, "A simulated rig takes photographs"));
  server.run([] { return !interrupted(); });
  return {};
}

}  // namespace

Job add_serve(CLI::App& command) {
  const auto arguments = std::make_shared<ServeArguments>();
  command
      .add_option("device", arguments->device,
                  "The simulated board: sim: or sim:?jumper=OUT:IN. With --photographs, a simulated rig")
      ->required()
      ->type_name("sim:");
  command
      .add_option("--listen", arguments->place, "Where it answers: a local socket, or a port of this machine")
      ->required()
      ->type_name("unix:PATH|tcp:127.0.0.1:PORT");
  command.add_flag("--photographs", arguments->photographs,
                   "Serve a whole simulated rig: it takes patterns and answers photographs");
  command.footer(
      std::string("Example:\n"
                  "  symrig serve sim: --listen unix:/tmp/board.sock\n"
                  "  symrig info --device unix:/tmp/board.sock\n"
                  "  symrig serve 'sim:gummy?size=64x64' --photographs --listen unix:/tmp/rig.sock\n"
                  "\n"
                  "For people who write a host of their own. The board runs the real firmware, and its clock "
                  "follows real time.\n"
                  "It speaks the bytes of protocol/PROTOCOL.md with one host after the other.\n"
                  "With --photographs, a host needs no board: it speaks the framing of exec: rigs "
                  "(docs/howto-own-rig.md).\n"
                  "\n") +
      kExitCodes);
  return [arguments] {
    return arguments->photographs ? serve_photographs(*arguments) : serve_board(*arguments);
  };
}

}  // namespace symrig::apps
