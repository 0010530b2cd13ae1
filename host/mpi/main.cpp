// SPDX-License-Identifier: Apache-2.0
// `symrig-mpi`: jobs on scenes that are dealt over several processes or machines. mpirun starts them.
#include "commands.hpp"
#include "dealt_transport.hpp"
#include "meter.hpp"
#include "program.hpp"
#include "ranks.hpp"
#include "symrig/base/files.hpp"

#include <csignal>
#include <exception>
#include <string>

#include <fmt/format.h>
#include <unistd.h>

namespace symrig::mpi {
namespace {

/// What on_stop() writes; a signal handler may not make a text.
std::string& stop_line() {
  static std::string line;
  return line;
}

/// mpirun sends SIGTERM to all ranks if one of them has died, and when it is stopped itself. A rank that
/// waits in MPI cannot notice it otherwise.
void on_stop(int) {
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, stop_line().data(), stop_line().size());
  ::_exit(exit_code(ErrorCode::interrupted));
}

void end_on_stop() {
  apps::catch_interrupts();
  const Ranks ranks = Ranks::world();
  if (ranks.count() == 1) return;
  stop_line() = fmt::format(
      "symrig-mpi: rank {} was stopped: another rank died, or the job was stopped; no file is half-written; "
      "run it again\n",
      ranks.rank());
  static_cast<void>(std::signal(SIGTERM, on_stop));
}

/// The job of this rank. Returns the exit code, which is the same on all ranks.
int run_job(const Ranks& ranks, int argc, char** argv) {
  if (!ranks.first()) {
    end_on_stop();
    apps::keep_freed_memory();  // the first rank's run_program() does so there
    return help(ranks);
  }
  const int code = apps::run_program(mpi_program(end_on_stop), argc, argv);
  release(ranks, code);
  return code;
}

int run_rank(int argc, char** argv) {
  const Ranks ranks = Ranks::world();
  const int code = run_job(ranks, argc, argv);
  // mpirun stops the others as soon as one has ended with an error code. They are done too.
  static_cast<void>(std::signal(SIGTERM, SIG_IGN));
  meet();
  return code;
}

}  // namespace
}  // namespace symrig::mpi

int main(int argc, char** argv) {
  symrig::reserve_standard_streams();
  const symrig::mpi::Session session(argc, argv);
  try {
    return symrig::mpi::run_rank(argc, argv);
  } catch (const std::exception& error) {
    symrig::write_standard_error(fmt::format("symrig-mpi: internal fault: {}\n", error.what()));
  }
  symrig::mpi::abort_all(symrig::exit_code(symrig::ErrorCode::limit));
}
