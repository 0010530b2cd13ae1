// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/job_files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/program/program_file.hpp"

#include <optional>
#include <string>
#include <vector>

namespace symrig::apps {

/// The board that `--board` names: a board at a URI, or the JSON description of a board in a file.
/// fails: bad_argument, not_found, bad_format, device_lost.
Result<BoardInfo> board_info_of(const std::string& board);

/// The files that a command on a program reads: the program, the files that it names, and `--board` unless it
/// is a URI.
JobFiles program_files(const std::string& file, const std::string& board);

/// A program from a file: TOML compiled for `board`, or a compiled program.
struct ProgramInput {
  CompiledProgram program;
  std::vector<FileFinding> findings;  ///< of a TOML file; none has the severity error
};

/// Where a program file is, before it is parsed; "-" is standard input. A file with this name is ./-.
struct ProgramSource {
  std::string file;
  std::optional<std::string>
      typed;       ///< what standard input had; its files are relative to the current folder
  JobFiles files;  ///< what the program and `--board` read

  /// fails: as read_program_file.
  Result<ProgramFile> read() const;
};
/// fails: as read_standard_input.
Result<ProgramSource> program_source(const std::string& file, const std::string& board);

/// The first error of a compilation. The hint counts the other errors.
Error first_error(const std::string& file, const Compilation& compilation);

/// Prints one line for each finding, such as "scan.toml:12: warning: ...". On a terminal, their severities
/// have colours. fails: io.
Result<void> print_findings(const std::string& file, const std::vector<FileFinding>& findings,
                            Severity least);

/// Does the file hold a compiled program (scan.symprog)? fails: not_found, io.
Result<bool> is_compiled(const std::string& file);
/// fails: not_found, io, bad_format.
Result<CompiledProgram> load_compiled(const std::string& file);

/// "24 records, 800 patterns, 3200 exposures, about 66.7 s, 83.3 ms a pattern": two lines at most.
std::string program_summary(const CompiledProgram& program);

}  // namespace symrig::apps
