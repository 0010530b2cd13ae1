// SPDX-License-Identifier: Apache-2.0
// The commands that are those of `symrig`, with a scene that is dealt over the ranks.
#include "commands.hpp"
#include "dealt_transport.hpp"

#include <string>
#include <string_view>

namespace symrig::mpi {
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
