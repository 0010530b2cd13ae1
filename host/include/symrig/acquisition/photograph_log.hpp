// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig {

/// One entry of a log.
struct LoggedPhotograph {
  Pattern pattern;
  Radiance photograph;
};

/// Rows that PhotographLog::rows() gives at once.
inline constexpr int kLogStripRows = 32;

/// The photographs of one capture in the order they were taken, each with its pattern and with what the probe
/// had spent by then. What went in comes out bit for bit, if kept() does not change it. Number k counts from
/// 0. Any number of threads may read at once, but none while append() runs.
class PhotographLog {
 public:
  PhotographLog() = default;
  PhotographLog(const PhotographLog&) = delete;
  PhotographLog& operator=(const PhotographLog&) = delete;
  virtual ~PhotographLog() = default;

  /// Of patterns.
  virtual Grid grid() const = 0;
  /// Of photographs: grid(), unless it keeps what a camera with pixels of its own saw.
  virtual Grid camera_grid() const { return grid(); }
  virtual int channels() const = 0;
  /// Photographs held.
  virtual std::int64_t size() const = 0;

  /// Adds photographs that were taken together, all or none: also a process killed on the way leaves none of
  /// them. spent: Probe::cost() after them. After a failure the log holds what it held before, and may be
  /// appended to again.  fails: size_mismatch, io (a full disk).
  virtual Result<void> append_run(std::span<const Pattern> patterns, std::span<const Radiance> photographs,
                                  const ProbeCost& spent) = 0;
  /// The same for one.
  Result<void> append(const Pattern& pattern, const Radiance& photograph, const ProbeCost& spent) {
    return append_run({&pattern, 1}, {&photograph, 1}, spent);
  }

  /// 0 ≤ k < size().  fails: bad_argument (no such number), io, bad_format (the bytes have changed since).
  virtual Result<Pattern> pattern(std::int64_t k) const = 0;
  virtual Result<Radiance> photograph(std::int64_t k) const = 0;
  /// Both into memory that is used again: pictures of the log's size in `to` are overwritten, others
  /// replaced.
  virtual Result<void> read(std::int64_t k, LoggedPhotograph& to) const = 0;
  /// kLogStripRows rows of photograph k, from number strip · kLogStripRows on, or up to the last one. `to`
  /// becomes so large.
  virtual Result<void> rows(std::int64_t k, int strip, Radiance& to) const;
  /// The photograph as the log would give it back. A log of a camera's own photographs rounds them.
  virtual Radiance kept(Radiance photograph) const { return photograph; }
  /// By the end of the run that photograph k was taken in.
  virtual Result<ProbeCost> spent(std::int64_t k) const = 0;

  /// True if photograph k was taken by a capture with a budget: with a larger one it may ask for another.
  virtual bool budgeted([[maybe_unused]] std::int64_t k) const { return false; }
  /// Expectation::budget_note() of the photographs that are appended next, and of photograph k. A log that
  /// keeps no notes on budgets has none.
  virtual void note_budget([[maybe_unused]] std::int32_t note) {}
  virtual std::int32_t budget_note([[maybe_unused]] std::int64_t k) const { return 0; }
  /// The capture asks for another photograph number `differs` than the log holds. Forgets the photographs
  /// from number `first` on, if a smaller budget chose them; a file keeps them until the next append_run().
  /// fails: bad_format (why they are kept: the log is as it was).
  virtual Result<void> forget(std::int64_t first, std::int64_t differs);
  /// Forgets them whoever chose them. Only a log in memory does.  fails: bad_argument.
  virtual Result<void> cut(std::int64_t first);
};

/// A log that lives as long as the process, in memory or a scratch file (MemoryScope): 8 bytes a pixel and
/// channel, and some bits, a photograph.
/// camera: the grid of photographs, if it is another one.
std::unique_ptr<PhotographLog> make_memory_log(Grid grid, int channels, std::optional<Grid> camera = {});

/// What a capture may spend. It is not part of what a log is of: a capture may be continued with more.
struct LogBudget {
  std::int64_t photographs = 0;  ///< 0: no limit
  double rig_seconds = 0;        ///< 0: no limit
  bool any = false;              ///< these or another limit, such as an error to reach
};

/// What a capture must share with its log to be continued from it. The texts hold one fact a line, so that a
/// difference can be named.
struct LogIdentity {
  Grid grid;
  int channels = 1;
  std::string rig;        ///< Probe::identity()
  std::string options;    ///< what steers the choice of patterns, "name value" lines
  LogBudget budget = {};  ///< of this capture; not compared
  /// Of a log that keeps what a camera with pixels of its own saw: the step to which each of its samples is
  /// rounded, above 0. Such a log takes 3 bytes a sample. None: photographs are on `grid`, as floats.
  std::shared_ptr<const Image<float>> steps = {};

  Grid camera() const { return steps ? steps->grid() : grid; }
};

/// Bytes that a photograph adds to a file, if its pattern is binary.
std::int64_t bytes_of_photograph(const LogIdentity& identity);

/// A log in a file (docs/photograph-log.md). What was appended is safe from the death of the process; synced
/// to the disk every few seconds against a loss of power. The file is locked while it is open. fails:
/// bad_argument (there is a log already), not_found (no folder), io.
Result<std::unique_ptr<PhotographLog>> create_photograph_log(const std::filesystem::path& path,
                                                             const LogIdentity& identity);

/// Opens a log to read it and to append to it. Every photograph is checked (CRC-32C); what comes from the
/// first run on that is torn or damaged is left out. The file itself changes with the first append_run():
/// then that part is cut, and a head whose writer was killed becomes whole. fails: not_found; bad_format (not
/// a log, of a newer version, or of another capture: the difference is named); io (also: another process has
/// it open).
Result<std::unique_ptr<PhotographLog>> open_photograph_log(const std::filesystem::path& path,
                                                           const LogIdentity& identity);

/// Whether a log keeps what a camera with pixels of its own saw (LogIdentity::steps).
/// fails: not_found, io; bad_format (not a log, or of a newer version).
Result<bool> keeps_camera_photographs(const std::filesystem::path& path);

/// Opens the log of any capture to read it. Any number of processes may read a log at once, but none while
/// another one may write to it. Photographs are checked and left out as by open_photograph_log(). The file
/// never changes.
/// fails: not_found; bad_format (not a log, or of a newer version); io (also: a capture has it open).
Result<std::unique_ptr<const PhotographLog>> read_photograph_log(const std::filesystem::path& path);

/// Where a log keeps what a camera with pixels of its own saw, and a capture needs photographs on the cells.
struct Development {
  Probe& camera;  ///< takes the photographs for the log
  std::function<Result<Radiance>(const Radiance& photograph)> to_cells;
  /// So many of the last photographs are not part of the capture after all.
  std::function<void(std::int64_t photographs)> forget;
  PhotographLog& cells;  ///< gets all photographs on the cells: those of the log too
};

/// A probe that answers from a log as long as the log holds the patterns that are asked for. After that it
/// asks another probe, and logs each photograph as it arrives. A capture is a deterministic function of its
/// photographs. So a capture that was killed is continued by running it again on this.
class LoggedProbe final : public Probe {
 public:
  /// Both must outlive this. together: how many photographs the inner probe is asked for at once; a killed
  /// process loses at most as many. More than one pays where photographs are computed in parallel.
  LoggedProbe(Probe& inner, PhotographLog& log, std::size_t together = 1)
      : LoggedProbe(inner, log, together, std::nullopt) {}
  /// inner: the photographs are those of `development` on its cells; costs are its own. What `development`
  /// names must outlive this.
  LoggedProbe(Probe& inner, PhotographLog& log, std::size_t together, std::optional<Development> development)
      : inner_(inner),
        log_(log),
        development_(std::move(development)),
        together_(together > 0 ? together : 1),
        begun_(inner.cost_before()) {}

  Grid grid() const override { return inner_.grid(); }
  Grid camera_grid() const override { return inner_.camera_grid(); }
  int channels() const override { return inner_.channels(); }
  ViewLayout views() const override { return inner_.views(); }
  double residual_shift() const override { return inner_.residual_shift(); }
  /// Where a smaller budget chose the log's next photographs and this capture asks for others, it measures on
  /// from there.  fails: also bad_format (the log has another pattern for another reason), and as
  /// append_run().
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    return measure_expected(patterns, {});
  }
  /// Photographs in the log need no expectation.
  bool plans_exposures(std::size_t photographs) const override;
  /// expected: one a pattern, or none at all.
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) override;
  /// Photographs answered from the log count as they did when they were taken; setting up the rig again
  /// (metering, black) does not count again, nor do captures before this one.
  ProbeCost cost() const override;
  std::size_t together() const override { return together_; }
  bool computes() const override { return inner_.computes(); }
  /// After each photograph that the log gives, and after each run that it keeps.
  void tell(const TakenSome& taken) override { taken_ = taken; }
  std::string describe() const override { return inner_.describe(); }

  /// Photographs answered from the log so far.
  std::int64_t replayed() const { return replayed_; }

 private:
  Result<std::optional<Radiance>> replay(const Pattern& pattern, const Expectation* expected);
  Result<void> leave_log(std::vector<Radiance>& photographs, bool planned);
  Result<Radiance> developed(const Pattern& pattern, Radiance photograph, const ProbeCost& spent) const;
  Result<std::vector<Radiance>> take(std::span<const Pattern> patterns,
                                     std::span<const Expectation> expected);
  Result<void> go_on();
  Result<void> told(std::size_t photographs) const;
  Result<void> measure_on(std::span<const Pattern> patterns, std::span<const Expectation> expected,
                          std::vector<Radiance>& photographs);

  Probe& inner_;
  PhotographLog& log_;
  std::optional<Development> development_;
  std::size_t together_;
  std::int64_t replayed_ = 0;
  bool measuring_ = false;   // the log is used up: inner_ answers
  ProbeCost replayed_cost_;  // by the last photograph that was replayed
  ProbeCost before_;         // of inner_ when it took over
  ProbeCost begun_;          // of inner_ by captures before this one
  TakenSome taken_;
};

}  // namespace symrig
