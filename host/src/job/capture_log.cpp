// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/capture_job.hpp"
#include "symrig/report/text.hpp"

#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;

/// Device and inode; zeros if there is no file.
std::pair<std::uint64_t, std::uint64_t> file_at(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return {0, 0};
  return {status.st_dev, status.st_ino};
}

}  // namespace

std::string CaptureLog::path_of(const std::string& output) {
  return output + ".log";
}

JobFiles CaptureLog::declare(const std::string& output, const LogOptions& options, JobFiles files) {
  if (!options.off) files.writes("the log", path_of(output), FileFormat::log);
  return files;
}

Result<void> CaptureLog::check(const std::string& output, const LogOptions& options) {
  std::error_code ignored;
  const std::string path = path_of(output);
  if (options.off || options.resume || !fs::exists(path, ignored)) return {};
  return Error{ErrorCode::bad_argument,
               fmt::format("{} holds the photographs of a capture that was interrupted or still runs", path),
               "continue with resume, or delete the log to start again"};
}

bool CaptureLog::goes_on(const std::string& output, const LogOptions& options) {
  std::error_code ignored;
  return options.resume && fs::exists(path_of(output), ignored);
}

Result<CaptureLog> CaptureLog::open(const std::string& output, const LogOptions& options,
                                    const LogIdentity& identity) {
  CaptureLog capture;
  if (options.off) return capture;
  capture.path_ = path_of(output);
  capture.keep_ = options.keep;
  if (goes_on(output, options)) {
    SYMRIG_TRY(capture.log_, open_photograph_log(capture.path_, identity));
  } else {
    SYMRIG_TRY(capture.log_, create_photograph_log(capture.path_, identity));
    capture.created_ = true;
  }
  capture.file_ = file_at(capture.path_);
  capture.found_ = capture.log_->size();
  return capture;
}

bool CaptureLog::still_there() const {
  return file_at(path_) == file_;
}

Error CaptureLog::broken_off(Error error) {
  if (!log_) return error;
  if (log_->size() == 0) {
    std::error_code ignored;
    if (created_ && still_there()) fs::remove(path_, ignored);
    return error;
  }
  // The error is about the log itself. The log stays as it was, and resuming would not help.
  if (error.code == ErrorCode::bad_format && log_->size() == found_) return error;
  if (!error.hint.empty() && error.code != ErrorCode::interrupted) error.what += "; " + error.hint;
  if (!still_there()) {
    error.hint = fmt::format("{} was deleted or moved during the capture, so no photographs are kept", path_);
    return error;
  }
  error.hint = fmt::format("{} keeps {} photographs: continue with resume", path_,
                           text::grouped(static_cast<double>(log_->size())));
  return error;
}

Error CaptureLog::useless(Error error) {
  if (!log_ || keep_) return error;
  std::error_code ignored;
  if (still_there()) fs::remove(path_, ignored);
  return error;
}

Result<void> CaptureLog::finished() {
  if (!log_ || keep_ || !still_there()) return {};
  std::error_code failed;
  fs::remove(path_, failed);
  if (!failed) return {};
  return Error{ErrorCode::io, fmt::format("{} cannot be deleted ({})", path_, failed.message()),
               "the capture is complete: delete the log by hand"};
}

}  // namespace symrig
