// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/job_files.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// `--resume`, `--keep-log`, `--no-log` of commands that measure.
struct LogOptions {
  bool resume = false;
  bool keep = false;
  bool off = false;
};
void add_log_options(CLI::App& command, LogOptions& options);

/// The photographs of a running capture in `<output>.log`, until the output itself is safe on the disk.
class CaptureLog {
 public:
  /// The log among the files of a capture.
  static JobFiles declare(const std::string& output, const LogOptions& options, JobFiles files);
  /// Before long work.  fails: bad_argument (a log is there and nobody said --resume).
  static Result<void> check(const std::string& output, const LogOptions& options);
  /// Whether a log is there that --resume goes on from.
  static bool goes_on(const std::string& output, const LogOptions& options);
  /// Begins a log, or continues the one that is there. With --no-log: keeps nothing.
  /// fails: as create_photograph_log and open_photograph_log.
  static Result<CaptureLog> open(const std::string& output, const LogOptions& options,
                                 const LogIdentity& identity);

  /// nullptr with --no-log.
  PhotographLog* log() const { return log_.get(); }

  /// After a failed capture: deletes a new log without photographs, or says in the error how to go on.
  Error broken_off(Error error);
  /// After the output was written: deletes the log unless it is to be kept.  fails: io.
  Result<void> finished();

 private:
  CaptureLog() = default;
  bool still_there() const;

  std::string path_;
  std::pair<std::uint64_t, std::uint64_t> file_;  ///< device and inode of the log
  std::int64_t found_ = 0;                        ///< photographs when it was opened
  bool keep_ = false;
  bool created_ = false;
  std::unique_ptr<PhotographLog> log_;
};

}  // namespace symrig::apps
