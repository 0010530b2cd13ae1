// SPDX-License-Identifier: Apache-2.0
// usage: symrig_mpi_manual FOLDER
// Writes FOLDER/man1/*.1: manual pages of `symrig-mpi`, as symrig_manual does those of `symrig`.
#include "commands.hpp"
#include "manual/pages.hpp"

namespace symrig::mpi {
namespace {

Result<void> write_manual(const std::filesystem::path& folder) {
  const apps::Program program = mpi_program(nullptr);
  CLI::App app;
  apps::declare(app, program);
  return apps::write_pages(folder, program, app);
}

}  // namespace
}  // namespace symrig::mpi

int main(int argc, char** argv) {
  return symrig::apps::make_manual(argc, argv, symrig::mpi::write_manual);
}
