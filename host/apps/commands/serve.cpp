// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "symrig/board/link.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/rig/exec_probe.hpp"
#include "symrig/rig/pair_link.hpp"
#include "symrig/rig/rig_file.hpp"
#include "symrig/sim/simulated_pairs.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct ServeArguments {
  std::string device, place, pair, secret;
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

/// "2/1x2": pair 2 of one row of two pairs.
struct PairPlace {
  ViewLayout layout;
  std::size_t pair = 0;  ///< from 0
};

Result<PairPlace> parse_pair(std::string_view text) {
  constexpr int kMost = 64;  // rows or columns
  const std::size_t slash = std::min(text.find('/'), text.size());
  const auto pair = plain_number(text.substr(0, slash));
  const auto layout = two_numbers(text.substr(std::min(slash + 1, text.size())), 'x');
  const auto possible = [&](int rows, int cols) {
    return rows >= 1 && rows <= kMost && cols >= 1 && cols <= kMost && *pair >= 1 && *pair <= rows * cols;
  };
  if (!pair || !layout || !possible(layout->first, layout->second))
    return Error{ErrorCode::bad_argument, fmt::format("--pair cannot be '{}'", text),
                 "give PAIR/ROWSxCOLUMNS, such as 1/1x2 for the first of two pairs"};
  return PairPlace{{layout->first, layout->second}, static_cast<std::size_t>(*pair - 1)};
}

/// A pair of a simulated scene, or the camera and the projector of a rig file.
Result<std::unique_ptr<PairService>> make_pair_of(const std::string& rig, const PairPlace& place) {
  if (is_simulated(rig)) return make_simulated_pair(rig, place.layout, place.pair);
  if (!is_rig_file(rig))
    return Error{ErrorCode::bad_argument, fmt::format("'{}' is not a pair", rig),
                 "give a rig file, or a simulated rig with several views, such as sim:views2"};
  SYMRIG_CHECK(check_rig_exists(rig));
  SYMRIG_TRY(const RigDescription file, read_rig_file(rig, RigUse::served));
  return serve_devices(devices_of(file), place.layout, place.pair);
}

Result<void> serve_pair(const ServeArguments& arguments) {
  SYMRIG_TRY(const PairPlace place, parse_pair(arguments.pair));
  SYMRIG_TRY(auto pair, make_pair_of(arguments.device, place));
  auto server = PairServer::open(std::move(pair), arguments.place, arguments.secret);
  if (!server) return hint_in_command_words(server.error());
  SYMRIG_CHECK(tell(arguments, is_simulated(arguments.device)
                                   ? "A simulated pair takes its part of photographs"
                                   : "A pair waits for the host that fires it"));
  server->run([] { return !interrupted(); });
  return {};
}

Result<void> serve(const ServeArguments& arguments) {
  if (arguments.pair.empty() && !arguments.secret.empty())
    return Error{ErrorCode::bad_argument, "--secret is for a pair", "add --pair, or remove --secret"};
  if (!arguments.pair.empty() && arguments.photographs)
    return Error{ErrorCode::bad_argument, "--pair and --photographs cannot be combined", "give one of them"};
  if (!arguments.pair.empty()) return serve_pair(arguments);
  return arguments.photographs ? serve_photographs(arguments) : serve_board(arguments);
}

}  // namespace

Job add_serve(CLI::App& command) {
  const auto arguments = std::make_shared<ServeArguments>();
  command
      .add_option("device", arguments->device,
                  "The simulated board: sim: or sim:?jumper=OUT:IN. With --photographs, a simulated rig. "
                  "With --pair, a simulated rig or a rig file")
      ->required()
      ->type_name("sim:|FILE");
  command
      .add_option("--listen", arguments->place, "Where it answers: a local socket, or a port of this machine")
      ->required()
      ->type_name("unix:PATH|tcp:127.0.0.1:PORT");
  command
      .add_option("--pair", arguments->pair,
                  "Serve one projector-camera pair, for a rig file with several [[pair]] on another computer")
      ->type_name("PAIR/ROWSxCOLUMNS");
  command
      .add_option("--secret", arguments->secret,
                  "With --pair: a file with the secret that the host must know. TCP needs it; other machines "
                  "then reach the port")
      ->type_name("FILE");
  command.add_flag("--photographs", arguments->photographs,
                   "Serve a whole simulated rig: it takes patterns and answers photographs");
  command.footer(
      std::string("Example:\n"
                  "  symrig serve sim: --listen unix:/tmp/board.sock\n"
                  "  symrig info --device unix:/tmp/board.sock\n"
                  "  symrig serve 'sim:gummy?size=64x64' --photographs --listen unix:/tmp/rig.sock\n"
                  "  symrig serve 'sim:views2?size=64x64' --pair 1/1x2 --listen unix:/tmp/left.sock\n"
                  "\n"
                  "For people who write a host of their own. The board runs the real firmware, and its clock "
                  "follows real time.\n"
                  "It speaks the bytes of protocol/PROTOCOL.md with one host after the other.\n"
                  "With --photographs, a host needs no board: it speaks the framing of exec: rigs "
                  "(docs/howto-own-rig.md).\n"
                  "With --pair, a host joins several of them to one rig (docs/howto-several-rigs.md).\n"
                  "\n") +
      kExitCodes);
  return [arguments] { return serve(*arguments); };
}

}  // namespace symrig::apps
