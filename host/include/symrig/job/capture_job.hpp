// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/report/summary.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
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
  static std::string path_of(const std::string& output);
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

/// Looks at the photographs of a capture as they come. Called by the thread that captures.
using SeePhotographs = std::function<void(const ProbeCost& so_far, std::span<const Pattern> patterns,
                                          std::span<const Radiance> photographs)>;

/// One capture from its rig to its file: `symrig capture`, and capture() of the Python module.
struct CaptureJob {
  std::string output;   ///< scene.h5; empty: the scene is only returned, and there is no log
  LogOptions log = {};  ///< of `output`.log
  /// Bytes of memory that the process may use; 0: usual_memory(). What needs more is in scratch files beside
  /// the output. Only time depends on it, but for the camera's own pixels: if they need more, they are left
  /// out.
  std::int64_t memory = 0;
  std::string json = {};        ///< file of the capture's facts (capture_json); empty: none
  CaptureOptions options = {};  ///< its member `log` is set by the job
  bool cells_only = false;      ///< leave out the camera's own pixels
  /// Most time [s] that the computer takes for the camera's own pixels; none: no limit. If it is too little,
  /// the scene has cells only, and the log stays, so that a later job goes on with it.
  std::optional<double> fit_seconds = {};
  bool check_axis = false;          ///< a new capture first checks with 8 photographs that the rig is coaxial
  std::function<Made()> made = {};  ///< date, version and command; empty: not recorded
  SeePhotographs see = {};          ///< may be empty
  /// Judges the result before it is saved: with an error, the job ends with it and saves nothing. May be
  /// empty.
  std::function<Result<void>(const CaptureResult&)> accept = {};
  Stopwatch watch = {};  ///< from the start of the job
};

/// What a capture has found and saved.
struct CaptureOutcome {
  CaptureSummary summary;
  CaptureResult result;
  std::string json;                                    ///< capture_json of both
  std::shared_ptr<const CameraTransport> camera = {};  ///< T on the camera's own pixels, or none

  /// What the scene file has.
  StoredScene scene() &&;
};

/// Budgets as a person gives them: none means no limit.
struct GivenBudgets {
  std::optional<std::int64_t> max_patterns = {};
  std::optional<double> max_seconds = {};
  std::optional<double> target_error = {};
};

/// Refuses a budget of 0, because 0 means no limit in CaptureOptions.  fails: bad_argument.
Result<void> check_budgets(const GivenBudgets& given);

/// Checks the job before its rig is opened: options, and a log that is in the way.
/// fails: as settings_of; bad_argument (a log exists, and LogOptions::resume is not set).
Result<CaptureSettings> check_job(const CaptureJob& job);

/// Checks that the rig fits the job.
/// fails: as check_rig; bad_value (an algorithm that uses the symmetry of T needs a coaxial rig).
Result<void> check_job(const CaptureJob& job, const OpenedRig& rig);

/// The scene in the file of a job's output that the job will replace, if another rig measured it (as in
/// Probe::describe()); empty: no such file.
std::string scene_to_replace(const CaptureJob& job, const OpenedRig& rig);

/// Bytes that each photograph adds to the log; 0: the job keeps none.
std::int64_t log_bytes_each(const CaptureJob& job, const OpenedRig& rig);

/// The least memory of a job: what photographs take while they are worked on.
std::int64_t least_memory(Grid grid, int channels);

/// What a job takes if its memory has no limit, roughly: within a factor of 1.5 for V-grooves of 64x64 to
/// 1000x984 (docs/research/memory.md).
std::int64_t memory_wanted(const CaptureSettings& settings, Grid grid, int channels);

/// Captures, and writes scene, facts and log. Until the scene is safely on the disk, the log keeps the
/// photographs. Of a registered camera with more pixels than the projector has cells, the scene on the cells
/// is complete first. Then T on the camera's pixels is fitted to the photographs in the log, and the scene is
/// written again with it. If that fails or is stopped, the first scene and the log stay.
/// fails: as check_job; limit (CaptureJob::memory is less than least_memory); io (no space for scratch
/// files); as capture, create_photograph_log, open_photograph_log, save_scene and
/// RegisteredProbe::check_motion. The error says if a log keeps photographs.
Result<CaptureOutcome> run_job(const CaptureJob& job, OpenedRig& rig);

}  // namespace symrig
