// SPDX-License-Identifier: Apache-2.0
// usage: symrig_manual FOLDER
// Writes FOLDER/man1/*.1, FOLDER/symrig.bash, FOLDER/_symrig and FOLDER/command-line.md: manual pages,
// completions and the page docs/command-line.md of `symrig`. They come from the same declarations as the
// help, so they have every command and every option. Part of the build, not installed.
#include "manual/completions.hpp"
#include "manual/pages.hpp"
#include "program.hpp"
#include "symrig/base/files.hpp"

#include <filesystem>

namespace symrig::apps {
namespace {

Result<void> write_manual(const std::filesystem::path& folder) {
  CLI::App app;
  declare(app, symrig_program());
  SYMRIG_CHECK(write_pages(folder, symrig_program(), app));
  SYMRIG_CHECK(write_file_atomically(folder / "symrig.bash", bash_completion(app)));
  SYMRIG_CHECK(write_file_atomically(folder / "_symrig", zsh_completion(app)));
  return write_command_line(SYMRIG_COMMAND_TEXTS, folder / "command-line.md", symrig_program(), app);
}

}  // namespace
}  // namespace symrig::apps

int main(int argc, char** argv) {
  return symrig::apps::make_manual(argc, argv, symrig::apps::write_manual);
}
