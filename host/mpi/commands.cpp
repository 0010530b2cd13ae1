// SPDX-License-Identifier: Apache-2.0
// The table of commands, and those that are commands of `symrig` with a scene that is dealt over the ranks.

#include "commands.hpp"

#include "dealt_transport.hpp"

#include <string>
#include <string_view>

namespace symrig::mpi {

namespace {

constexpr apps::Command kCommands[] = {
    {"relight", "Compute the photograph of the scene under any light, or under many", add_relight},
    {"evaluate", "Compute the errors of a tensor against the true transport, or against held-out photographs",
     add_evaluate},
    {"solve", "Find the light that makes the scene look as wanted", add_solve},
    {"polish", "Refit the tensor of a capture to all its photographs", add_polish},
};

constexpr const char* kFooter =
    "Example:\n"
    "  mpirun -n 2 symrig-mpi relight scene.h5 --lights walk.y4m -o pictures.y4m\n"
    "  mpirun symrig-mpi solve scene.h5 --wanted look.exr -o light.exr\n"
    "  mpirun -n 2 symrig-mpi polish scene.h5 -o polished.h5\n"
    "\n"
    "Each process reads and applies its share of the scene. Results differ from those of one process only "
    "by rounding.\n"
    "docs/howto-machines.md says how to use several machines.\n"
    "\n"
    "Exit codes: 0 done, 2 usage, 3 device, 4 bad input, 5 fault or limit.";

}  // namespace

apps::Program mpi_program(void (*prepare)()) {
  return {"symrig-mpi",
          "relights and refits scenes that are dealt over several processes",
          "symrig-mpi works on scenes that are dealt over several processes.",
          kFooter,
          kCommands,
          prepare,
          false};
}

namespace {

/// The examples of the help name the other program.
void name_this_program(CLI::App& command) {
  std::string text = command.get_footer();
  const std::string_view theirs = "  symrig ";
  for (std::size_t at = text.find(theirs); at != std::string::npos; at = text.find(theirs, at + 1))
    text.replace(at, theirs.size(), "  mpirun symrig-mpi ");
  command.footer(text);
}

}  // namespace

Result<apps::OpenedScene> open_dealt(const std::string& path, const LoadOptions& options) {
  if (Ranks::world().count() == 1) return apps::open_here(path, options);
  if (options.memory > 0)
    return Error{ErrorCode::bad_argument, "--memory is for one process; of several, each holds its share",
                 "remove it, or start more processes"};
  SYMRIG_TRY(const auto transport, DealtTransport::open(Ranks::world(), path));
  return apps::OpenedScene{transport->scene(), transport};
}

apps::Job add_relight(CLI::App& command) {
  apps::Job job = apps::add_relight_of(command, open_dealt);
  name_this_program(command);
  return job;
}

apps::Job add_evaluate(CLI::App& command) {
  apps::Job job = apps::add_evaluate_of(command, open_dealt);
  name_this_program(command);
  return job;
}

}  // namespace symrig::mpi
