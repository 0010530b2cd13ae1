// SPDX-License-Identifier: Apache-2.0
#include "commands.hpp"

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

}  // namespace symrig::mpi
