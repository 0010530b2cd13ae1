// SPDX-License-Identifier: Apache-2.0
#include "manual/write_pages.hpp"

#include "console.hpp"
#include "manual/pages.hpp"
#include "symrig/base/files.hpp"

#include <exception>
#include <string>

#include <fmt/format.h>

namespace symrig::apps {

Result<void> write_pages(const std::filesystem::path& folder, const Program& program, const CLI::App& app) {
  const std::filesystem::path pages = folder / "man1";
  std::error_code error;
  std::filesystem::create_directories(pages, error);
  if (error) return Error{ErrorCode::io, folder.string() + ": " + error.message(), "choose another folder"};
  SYMRIG_CHECK(
      write_file_atomically(pages / (program.name + ".1"), program_page(program, app, SYMRIG_VERSION)));
  for (const Command& command : program.commands) {
    const std::string name(command.name);
    SYMRIG_CHECK(write_file_atomically(pages / fmt::format("{}-{}.1", program.name, name),
                                       command_page(program, *app.get_subcommand(name), SYMRIG_VERSION)));
  }
  return {};
}

int make_manual(int argc, char** argv, Result<void> (*write)(const std::filesystem::path& folder)) {
  if (argc != 2) {
    write_standard_error("usage: symrig_manual FOLDER\n");
    return exit_code(ErrorCode::bad_argument);
  }
  try {
    const auto written = write(argv[1]);
    if (written) return 0;
    print_error("", written.error().line());
    return exit_code(written.error().code);
  } catch (const std::exception& error) {
    write_standard_error(error.what());
  }
  return exit_code(ErrorCode::limit);
}

}  // namespace symrig::apps
