// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/job_files.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

namespace symrig {

/// What becomes of the log of a capture. Messages name the member `resume`, as CaptureOptions' messages do.
struct LogOptions {
  bool resume = false;  ///< continue from the log, if there is one
  bool keep = false;    ///< do not delete the log when the output is complete
  bool off = false;     ///< keep no log
};

/// Keeps the photographs of a running capture in `<output>.log` until the output itself is safely on the
/// disk.
class CaptureLog {
 public:
  /// Adds the log to the files of a capture.
  static JobFiles declare(const std::string& output, const LogOptions& options, JobFiles files);
  /// To be called before long work.
  /// fails: bad_argument (a log exists, and resume is not set).
  static Result<void> check(const std::string& output, const LogOptions& options);
  /// Whether resume is set and a log exists.
  static bool goes_on(const std::string& output, const LogOptions& options);
  /// Creates a log, or opens the existing one to resume. With LogOptions::off it keeps nothing.
  /// fails: as create_photograph_log and open_photograph_log.
  static Result<CaptureLog> open(const std::string& output, const LogOptions& options,
                                 const LogIdentity& identity);

  /// nullptr with LogOptions::off.
  PhotographLog* log() const { return log_.get(); }

  /// After a failed capture: deletes a new log without photographs, or adds to the error how to continue.
  Error broken_off(Error error);
  /// After a capture whose photographs show a fault of the rig: deletes them, unless LogOptions::keep is set.
  Error useless(Error error);
  /// After the output is written: deletes the log unless LogOptions::keep is set.
  /// fails: io.
  Result<void> finished();

 private:
  CaptureLog() = default;
  bool still_there() const;

  std::string path_;
  std::pair<std::uint64_t, std::uint64_t> file_;  ///< device and inode of the log
  std::int64_t found_ = 0;                        ///< photographs in the log when it was opened
  bool keep_ = false;
  bool created_ = false;
  std::unique_ptr<PhotographLog> log_;
};

}  // namespace symrig
