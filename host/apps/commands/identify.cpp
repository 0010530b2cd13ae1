// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "options.hpp"
#include "output.hpp"

#include <cmath>
#include <memory>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct IdentifyArguments {
  std::string device;
  double seconds = 5;
};

Result<void> run(const IdentifyArguments& arguments) {
  if (!(arguments.seconds >= 0 && arguments.seconds <= 60))
    return Error{ErrorCode::bad_argument,
                 fmt::format("--seconds {} is not between 0 and 60", arguments.seconds),
                 "give 0 to 60; 0 stops the blinking"};
  SYMRIG_TRY(auto board, open_board(arguments.device));
  SYMRIG_CHECK(board.identify(Nanoseconds{std::llround(1e9 * arguments.seconds)}));
  return print(fmt::format("{} {} {}\n", board.info().board, board.info().unique_id,
                           arguments.seconds > 0
                               ? fmt::format("blinks for {} s", std::ceil(arguments.seconds))
                               : "stopped blinking"));
}

}  // namespace

Job add_identify(CLI::App& command) {
  const auto arguments = std::make_shared<IdentifyArguments>();
  add_device(command, arguments->device);
  command.add_option("--seconds", arguments->seconds, "Seconds to blink, 0 to 60, rounded up; 0 stops it")
      ->capture_default_str()
      ->type_name("S");
  command.footer(std::string("Example:\n"
                             "  symrig identify --device E66038\n"
                             "\n") +
                 kDeviceHelp + "\n" + kExitCodes);
  takes_number<double>(command.get_option("--seconds"));
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
