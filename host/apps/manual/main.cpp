// SPDX-License-Identifier: Apache-2.0
// usage: symrig_manual FOLDER
// Writes FOLDER/man1/*.1, FOLDER/symrig.bash and FOLDER/_symrig: manual pages and completions of `symrig`.
// They come from the same declarations as the help, so they have every command and every option. Part of the
// build, not installed.
#include "command_table.hpp"
#include "console.hpp"
#include "manual/completions.hpp"
#include "manual/pages.hpp"
#include "program.hpp"
#include "symrig/base/atomic_file.hpp"
#include "symrig/base/standard_streams.hpp"

#include <exception>
#include <filesystem>
#include <span>
#include <string>

namespace symrig::apps {
namespace {

Result<void> write(const std::filesystem::path& path, const std::string& text) {
  return write_file_atomically(path, std::as_bytes(std::span(text)));
}

Result<void> write_manual(const std::filesystem::path& folder) {
  CLI::App app;
  declare(app, symrig_program());
  std::error_code error;
  std::filesystem::create_directories(folder / "man1", error);
  if (error) return Error{ErrorCode::io, folder.string() + ": " + error.message(), "choose another folder"};
  SYMRIG_CHECK(write(folder / "man1/symrig.1", program_page(app, SYMRIG_VERSION)));
  for (const Command& command : commands()) {
    const std::string name(command.name);
    SYMRIG_CHECK(write(folder / ("man1/symrig-" + name + ".1"),
                       command_page(*app.get_subcommand(name), SYMRIG_VERSION)));
  }
  SYMRIG_CHECK(write(folder / "symrig.bash", bash_completion(app)));
  return write(folder / "_symrig", zsh_completion(app));
}

}  // namespace
}  // namespace symrig::apps

int main(int argc, char** argv) {
  if (argc != 2) {
    symrig::write_standard_error("usage: symrig_manual FOLDER\n");
    return symrig::exit_code(symrig::ErrorCode::bad_argument);
  }
  try {
    const auto written = symrig::apps::write_manual(argv[1]);
    if (written) return 0;
    symrig::apps::print_error("", written.error().line());
    return symrig::exit_code(written.error().code);
  } catch (const std::exception& error) {
    symrig::write_standard_error(error.what());
  }
  return symrig::exit_code(symrig::ErrorCode::limit);
}
