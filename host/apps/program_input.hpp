// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/job_files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/program/compile.hpp"

#include <string>
#include <vector>

namespace symrig::apps {

/// What `--board` means: the board at a URI, or the JSON description of one in a file.
/// fails: bad_argument, not_found, bad_format, device_lost.
Result<BoardInfo> board_info_of(const std::string& board);

/// What commands on a program read: the file and the files that it names; `--board`, unless it is a URI.
JobFiles program_files(const std::string& file, const std::string& board);

/// A program as it was given: a file in TOML, compiled for `board`, or a compiled one.
struct ProgramInput {
  CompiledProgram program;
  std::vector<FileFinding> findings;  ///< of a TOML file; none is an error
};

/// The first error of a compilation as an Error with the rest counted.
Error first_error(const std::string& file, const Compilation& compilation);

/// "scan.toml:12: warning: ...": one line each.
std::string findings_text(const std::string& file, const std::vector<FileFinding>& findings, Severity least);

/// Does the file hold a compiled program (scan.symprog)? fails: not_found, io.
Result<bool> is_compiled(const std::string& file);
/// fails: not_found, io, bad_format.
Result<CompiledProgram> load_compiled(const std::string& file);

/// "24 records, 800 patterns, 3200 exposures, about 66.7 s, 83.3 ms a pattern": two lines at most.
std::string program_summary(const CompiledProgram& program);

}  // namespace symrig::apps
