// SPDX-License-Identifier: Apache-2.0
#include "program_input.hpp"

#include "output.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/link.hpp"
#include "symrig/program/compile.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <unistd.h>

namespace symrig::apps {

namespace {

constexpr std::uint64_t kMaxProgramFile = 256U << 20U;

Result<std::vector<std::uint8_t>> read_bytes(const std::string& file) {
  SYMRIG_TRY(const auto bytes, read_file(file, kMaxProgramFile));
  const auto* first = reinterpret_cast<const std::uint8_t*>(bytes.data());
  return std::vector<std::uint8_t>(first, first + bytes.size());
}

/// Puts the file's name before an error about its content.
Error about(const std::string& file, const Error& error) {
  return {error.code, file + ": " + error.what, error.hint};
}

Colour colour_of(Severity severity) {
  if (severity == Severity::error) return Colour::red;
  return severity == Severity::warning ? Colour::yellow : Colour::cyan;
}

/// The severity stands after the file and the line: "scan.toml:12: error: ...".
std::string coloured_finding(const std::string& file, const FileFinding& finding) {
  std::string text = printable(finding.text(file) + "\n");
  const std::string word = std::string(name(finding.severity)) + ":";
  const std::size_t at = text.find(": " + word, printable(file).size());
  if (at == std::string::npos) return text;
  return text.substr(0, at + 2) + coloured(word, colour_of(finding.severity)) +
         text.substr(at + 2 + word.size());
}

}  // namespace

JobFiles program_files(const std::string& file, const std::string& board) {
  JobFiles files;
  files.reads_settings("the input or a file that it names", file);
  return looks_like_uri(board) ? files : files.reads("--board", board);
}

Result<ProgramFile> ProgramSource::read() const {
  return typed ? parse_program_file(*typed, file, ".") : read_program_file(file);
}

Result<ProgramSource> program_source(const std::string& file, const std::string& board) {
  if (file != "-") return ProgramSource{file, std::nullopt, program_files(file, board)};
  SYMRIG_TRY(const std::string text, read_standard_input(kMaxProgramFile));
  ProgramSource source{file, text, JobFiles()};
  source.files.reads_settings_text("a file that the input names", text);
  if (!looks_like_uri(board)) source.files.reads("--board", board);
  return source;
}

Result<BoardInfo> board_info_of(const std::string& board) {
  if (looks_like_uri(board)) {
    SYMRIG_TRY(const auto uri, DeviceUri::parse(board));
    SYMRIG_TRY(auto link, open_link(uri));
    SYMRIG_TRY(const Board session, Board::connect(std::move(link)));
    return session.info();
  }
  SYMRIG_TRY(const auto bytes, read_bytes(board));
  auto info = parse_board_file({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!info) return about(board, info.error());
  return info;
}

Error first_error(const std::string& file, const Compilation& compilation) {
  const auto& all = compilation.findings;
  const auto is_error = [](const FileFinding& finding) { return finding.severity == Severity::error; };
  const auto count = std::count_if(all.begin(), all.end(), is_error);
  const auto first = std::find_if(all.begin(), all.end(), is_error);
  if (first == all.end()) return {ErrorCode::bad_value, file + " does not compile", "lint it"};
  return {ErrorCode::bad_value, fmt::format("{}:{}: {}: {}", file, first->place, first->rule, first->what),
          count > 1 ? fmt::format("{} (and {} more: symrig lint {})", first->alternative, count - 1, file)
                    : first->alternative};
}

Result<void> print_findings(const std::string& file, const std::vector<FileFinding>& findings,
                            Severity least) {
  std::string text;
  for (const FileFinding& finding : findings)
    if (finding.severity >= least)
      text += takes_colours(STDOUT_FILENO) ? coloured_finding(file, finding)
                                           : printable(finding.text(file) + "\n");
  return write_standard_output(text);
}

Result<bool> is_compiled(const std::string& file) {
  SYMRIG_TRY(const auto bytes, read_bytes(file));
  return looks_like_symprog(bytes);
}

Result<CompiledProgram> load_compiled(const std::string& file) {
  SYMRIG_TRY(const auto bytes, read_bytes(file));
  auto program = read_symprog(bytes);
  if (!program) return about(file, program.error());
  return program;
}

std::string program_summary(const CompiledProgram& program) {
  std::string text = fmt::format("{} records, {} words, ", program.program.records(),
                                 grouped(static_cast<double>(program.steps)));
  if (program.patterns > 0)
    text += fmt::format("{} patterns, {} exposures, ", grouped(static_cast<double>(program.patterns)),
                        grouped(static_cast<double>(program.exposures)));
  text += "about " + duration(seconds(program.expected));
  if (program.patterns > 0)
    text += fmt::format(", {:.6g} ms a pattern",
                        1e3 * seconds(program.expected) / static_cast<double>(program.patterns));
  text += fmt::format("; {} to {} with its waits\n", duration(seconds(program.shortest)),
                      duration(seconds(program.longest)));
  if (program.on_time)
    text += fmt::format("the projector shows each pattern for {:.6g} us (on_time)\n",
                        1e6 * seconds(*program.on_time));
  return text;
}

}  // namespace symrig::apps
