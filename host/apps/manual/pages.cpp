// SPDX-License-Identifier: Apache-2.0

#include "manual/pages.hpp"

#include "manual/argument.hpp"
#include "output.hpp"
#include "symrig/base/files.hpp"

#include <algorithm>
#include <cctype>
#include <exception>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::apps {

namespace {

using Lines = std::vector<std::string>;

/// Lines between blank lines.
std::vector<Lines> blocks_of(std::string_view text) {
  std::vector<Lines> blocks(1);
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty())
      blocks.back().push_back(line);
    else if (!blocks.back().empty())
      blocks.emplace_back();
  }
  if (blocks.back().empty()) blocks.pop_back();
  return blocks;
}

/// Text that roff prints as it stands.
std::string roff(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if (c == '\'')
      out += "\\(aq";
    else
      out += c;
  }
  return out.starts_with('.') ? "\\&" + out : out;
}

std::string bold(std::string_view text) {
  return "\\fB" + roff(text) + "\\fR";
}

std::string italic(std::string_view text) {
  return "\\fI" + roff(text) + "\\fR";
}

std::string verbatim(const Lines& lines) {
  std::string text = ".PP\n.nf\n.RS 2\n";
  for (const std::string& line : lines) text += roff(line.substr(line.find_first_not_of(' '))) + "\n";
  return text + ".RE\n.fi\n";
}

/// A row "  name  text", the continuation of a row (indented further), or a line of a paragraph.
std::string line_text(const std::string& line, bool& table) {
  const std::size_t indent = line.find_first_not_of(' ');
  if (indent == 0) return std::exchange(table, false) ? ".PP\n" + roff(line) + "\n" : roff(line) + "\n";
  if (indent > 2) return roff(line.substr(indent)) + "\n";
  table = true;
  const std::size_t end = line.find(' ', indent);
  const std::size_t text = end == std::string::npos ? end : line.find_first_not_of(' ', end);
  const std::string row = ".TP\n" + bold(line.substr(indent, end - indent)) + "\n";
  return text == std::string::npos ? row : row + roff(line.substr(text)) + "\n";
}

std::string paragraph(const Lines& lines) {
  std::string text = ".PP\n";
  bool table = false;
  for (const std::string& line : lines) text += line_text(line, table);
  return text;
}

/// The end of a help as sections of a manual page: "Example:" and "Exit codes:" have sections of their own.
/// In the others, "  name  text" is a row of a table.
std::string footer_sections(std::string_view footer) {
  std::string examples, notes, codes;
  for (const Lines& block : blocks_of(footer)) {
    if (block.front() == "Example:")
      examples += ".SH EXAMPLES\n" + verbatim({block.begin() + 1, block.end()});
    else if (block.front().starts_with("Exit codes:"))
      codes += ".SH \"EXIT STATUS\"\n" + paragraph(block);
    else
      notes += (notes.empty() ? ".SH NOTES\n" : "") + paragraph(block);
  }
  return notes + examples + codes;
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

/// No date: the same source gives the same page on every day.
std::string head(const std::string& name, const std::string& version, const std::string& about) {
  return fmt::format(
      ".\\\" Made by the build from the command's own tables.\n.TH {} 1 \"\" \"symrig {}\" \"symrig\"\n"
      ".SH NAME\n{} \\- {}\n",
      upper(roff(name)), version, roff(name), roff(about));
}

/// "--algorithm NAME" with the name's type.
std::string call_of(const Argument& argument) {
  const std::string type = argument.type.empty() ? "" : " " + italic(argument.type);
  if (argument.positional()) return italic(argument.type);
  return bold(argument.names.front()) + type;
}

std::string synopsis(const std::string& call, const std::vector<Argument>& arguments) {
  std::string text = ".SH SYNOPSIS\n" + bold(call) + "\n";
  for (const Argument& argument : arguments)
    text += (argument.required ? call_of(argument) : "[" + call_of(argument) + "]") + "\n";
  return text;
}

std::string option_row(const Argument& argument) {
  std::string row = ".TP\n";
  for (const std::string& name : argument.names) row += (row.ends_with('\n') ? "" : ", ") + bold(name);
  if (!argument.type.empty()) row += (argument.positional() ? "" : " ") + italic(argument.type);
  row += "\n" + roff(argument.about) + ".\n";
  if (argument.required) row += "Required.\n";
  if (!argument.standard.empty()) row += "Default: " + roff(argument.standard) + ".\n";
  return row;
}

std::string option_rows(const std::vector<Argument>& arguments) {
  std::string text = ".SH OPTIONS\n";
  for (const Argument& argument : arguments) text += option_row(argument);
  return text;
}

std::string page_of(const Program& program, std::string_view command) {
  return bold(fmt::format("{}-{}", program.name, command));
}

constexpr const char* kBoardVariable =
    ".TP\n\\fBSYMRIG_DEVICE\\fR\nThe board of commands that have no \\fB\\-\\-device\\fR.\n";
constexpr const char* kColourVariable =
    ".TP\n\\fBNO_COLOR\\fR\nIf it is set and not empty, terminals get no colours.\n";

constexpr const char* kDocuments =
    "The documents are in /usr/share/doc/symrig if the Debian package is installed, and at\n"
    "https://github.com/symrig/symrig.\n";

}  // namespace

std::string program_page(const Program& program, const CLI::App& app, const std::string& version) {
  std::string text = head(program.name, version, program.about);
  text += ".SH SYNOPSIS\n" + bold(program.name) + " \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n.SH DESCRIPTION\n" +
          roff(app.get_description()) + "\nEach command has its own page.\n.SH COMMANDS\n";
  for (const Command& command : program.commands)
    text += fmt::format(".TP\n{}(1)\n{}.\n", page_of(program, command.name), roff(command.about));
  text += option_rows(arguments_of(app)) + ".SH ENVIRONMENT\n" + (program.boards ? kBoardVariable : "") +
          kColourVariable + footer_sections(app.get_footer());
  text += ".SH \"SEE ALSO\"\n";
  for (const Command& command : program.commands)
    text += fmt::format("{}(1),\n", page_of(program, command.name));
  return text + (program.boards ? "\\fBsymrigd\\fR(8)" : "\\fBsymrig\\fR(1)") + "\n.PP\n" + kDocuments;
}

std::string command_page(const Program& program, const CLI::App& command, const std::string& version) {
  const std::string& name = command.get_name();
  const std::vector<Argument> arguments = arguments_of(command);
  std::string about = command.get_description();
  about.front() = static_cast<char>(std::tolower(static_cast<unsigned char>(about.front())));
  return head(program.name + "-" + name, version, about) + synopsis(program.name + " " + name, arguments) +
         ".SH DESCRIPTION\n" + roff(command.get_description()) + ".\n" + option_rows(arguments) +
         footer_sections(command.get_footer()) + ".SH \"SEE ALSO\"\n" + bold(program.name) + "(1)\n.PP\n" +
         kDocuments;
}

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
