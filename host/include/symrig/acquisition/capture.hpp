// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/algorithms.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/block_tree.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// How a search stood when a level was done.
struct CaptureStep {
  int level = 0;
  std::int64_t patterns = 0;  ///< photographs taken by then, the flood-lit and the held-out ones included
  double rig_seconds = 0;     ///< on the rig's clock by then
  /// Estimated frobenius error if the search had ended here; none: nothing was held out.
  std::optional<double> error = {};
};

/// A search that goes on, for those who watch it.
struct CaptureSnapshot {
  std::optional<CaptureStep> step = {};   ///< of the last level; none: only the flood-lit photograph is known
  std::optional<double> half_width = {};  ///< of the interval around its error (kErrorConfidence)
  /// T as it would be if the search ended here, without the last refinement. To be called once, on any
  /// thread, also after the capture: it rounds and packs a copy.
  std::function<TransportTensor()> tensor;
};

/// What a capture is expected to take, before the first pattern of its search. In nearly nine of ten captures
/// the time was right within a factor of 1.5 (docs/research/error-per-second.md).
struct CaptureForecast {
  std::int64_t patterns = 0;  ///< photographs of the whole capture, the flood-lit and held-out ones included
  double rig_seconds = 0;     ///< of the whole capture, on the rig's clock
};

/// How well photographs must be known where the rig chooses its exposures (Probe::measure_expected).
struct ExposureGoal {
  /// σ of dark pixels as a share of τ_A F, the misfit that a leaf may have.
  double share_of_tolerance = 0.7;
  /// RMS noise as a share of the RMS radiance: of lit pixels, and of dark ones (added to the former).
  double relative = 0.06;
  double relative_dark = 0.025;
  double longest_seconds = 10;  ///< of all exposures of one photograph
};

/// As Probe::measure_expected; `expected` may be empty. No photographs: the rig cannot be asked.
using LookAside = std::function<Result<std::vector<Radiance>>(std::span<const Pattern> patterns,
                                                              std::span<const Expectation> expected)>;

/// How to capture. The algorithm's own default replaces what is left out: capture(probe, {}) is
/// `symrig capture` without options. settings_of() refuses what makes no sense.
struct CaptureOptions {
  Algorithm algorithm = Algorithm::symrig;
  /// Detail to stop at, as a share of F: τ_A and τ_E of the rule; the threshold of dual. Above 0, below 1.
  std::optional<double> tolerance = {};
  std::optional<RankRule> rule = {};    ///< none: default_rule(algorithm)
  std::optional<Economy> economy = {};  ///< none: default_economy(algorithm)
  /// Economy::polish, 0 to 20, whatever time they take; none: the algorithm's own, within
  /// Economy::polish_share.
  std::optional<int> polish = {};
  ExposureGoal exposure = {};
  std::optional<double> photograph_seconds = {};  ///< ExposureGoal::longest_seconds, 0.01 to 100000
  /// Several views: how blocks are cut across them (docs/howto-views.md); none: chosen from the flood-lit
  /// photograph.
  std::optional<SplitOrder> split = {};
  /// dual: response below this share of F is not refined. Above 0, below 1; none: 3e-4.
  std::optional<double> dual_threshold = {};
  bool dual_subtracts = false;  ///< dual: subtract what is stored already, which [Sen05] does not do
  std::int64_t memory_limit = std::int64_t{12}
                              << 30;  ///< bytes; a capture that needs more ends with ErrorCode::limit
  std::int64_t max_patterns = 0;      ///< photographs at most; 0: no limit
  double max_seconds = 0;             ///< at most, on the rig's clock; 0: no limit
  /// Stop when the estimated frobenius error and its half width are below; 0: none. Below 1. Without
  /// `tolerance` and `rule`, the tolerance is the coarsest that is expected to reach it, at least the
  /// algorithm's own. If it does not, a finer search follows.
  double target_error = 0;
  /// Do not ask whether the first photographs contradict their patterns (ErrorCode::wrong_light).
  bool unchecked = false;
  /// What the probe logs to (LoggedProbe), to be read again; nullptr: photographs are not logged.
  PhotographLog* log = nullptr;
  /// May be empty. Asked after each photograph, or the few that a rig takes together, and after each step of
  /// computing work (Work::kStep), until the tensor is complete.
  Progress progress = {};
  /// Takes photographs that are no part of the capture, to find out what is wrong; empty: as the probe, if
  /// `log` is nullptr, else not at all.
  LookAside look_aside = {};
  /// Called by the thread that captures before its search, once the first photographs are taken and judged;
  /// may be empty. An error ends the capture.
  std::function<Result<void>()> before_search = {};
  /// Called by the thread that captures, once the flood-lit and the held-out photographs are taken; may be
  /// empty. A target that needs another search has another forecast. Only algorithms with held-out
  /// photographs call it.
  std::function<void(const CaptureForecast&)> foretell = {};
  /// Called by the thread that captures, after the flood-lit photograph and after each level; may be empty.
  /// It costs a copy of the transport known so far, and changes no result. dual and brute never call it.
  std::function<void(const CaptureSnapshot&)> watch = {};
};

/// What a capture runs with: its options, and the defaults for whatever they leave out.
struct CaptureSettings {
  Algorithm algorithm = Algorithm::symrig;
  RankRule rule = {};
  Economy economy = {};
  ExposureGoal exposure = {};
  std::optional<SplitOrder> split = {};
  double dual_threshold = 3e-4;
  bool dual_subtracts = false;
  std::int64_t memory_limit = 0;
  std::int64_t max_patterns = 0;  ///< 0: no limit
  double max_seconds = 0;         ///< 0: no limit
  double target_error = 0;        ///< 0: none
  bool keeps_tolerance = false;   ///< the user has given one: a target chooses no other
  bool unchecked = false;
  PhotographLog* log = nullptr;
  Work work = {};  ///< tells CaptureOptions::progress
  LookAside look_aside = {};
  std::function<Result<void>()> before_search = {};
  std::function<void(const CaptureForecast&)> foretell = {};
  std::function<void(const CaptureSnapshot&)> watch = {};
};

/// What capture() makes of options.
/// fails: bad_argument: a number that is none or out of its range, or an option that would change nothing
/// with this algorithm. The message begins with the name of the option, as CaptureOptions has it.
Result<CaptureSettings> settings_of(const CaptureOptions& options);

/// Options that would change nothing on this rig. capture() asks unless options.log is set: a rig that
/// answers from a log plans no exposures.  fails: bad_argument, as settings_of.
Result<void> check_rig(const CaptureOptions& options, const Probe& rig);

/// What the tests of one level said about pairs of different blocks.
struct LevelEvidence {
  int level = 0;
  std::int64_t patterns = 0;  ///< photographs of the level
  std::int64_t tested = 0;    ///< pairs of blocks
  std::int64_t leaves = 0;    ///< of these: one product explained them
  /// Share of the pairs' energy that no single product explains, beyond noise. Of four photographs that have
  /// nothing in common it is 3/4.
  double unexplained = 0;
};

/// A search that found the transport not data-sparse, or that could not trust what it had found.
struct Undetermined {
  std::string reason;            ///< one sentence
  std::int64_t patterns = 0;     ///< photographs taken by then
  std::int64_t forecast = 0;     ///< photographs that the search would have needed at least
  std::int64_t brute_force = 0;  ///< photographs that brute force takes
  bool completed = false;        ///< brute force measured the rest; otherwise a budget was in the way
  std::vector<LevelEvidence> levels = {};
};

struct CaptureResult {
  TransportTensor tensor;
  std::int64_t patterns = 0;                     ///< photographs taken
  std::vector<std::int64_t> patterns_per_level;  ///< [0] is the flood-lit one
  double process_seconds = 0;                    ///< subtract + test + schedule (merging is in Probe::cost)
  /// "done", or the budget that ended it or made it coarser: "max_patterns", "max_seconds", "target_error".
  std::string stopped_by = "done";
  /// Detail that the coarsest level was searched to, as a share of F; 0: the algorithm has none. Above
  /// CaptureSettings::rule where a budget or a target made it coarser.
  double tolerance = 0;
  /// From held_out; none: nothing was held out. NaN where an error cannot be estimated: estimate_not_given.
  std::optional<TransportErrors> estimated = {};
  TransportErrors estimated_half_width = {};  ///< of the interval around each (kErrorConfidence)
  /// Estimated frobenius error and its half width, which a target error is compared with; none: nothing was
  /// held out. NaN where there is no light to be relative to.
  std::optional<double> stated_error() const {
    if (!estimated) return {};
    return estimated->frobenius + estimated_half_width.frobenius;
  }
  std::vector<ErrorNotGiven> estimate_not_given = {};
  /// By the photographs of the search. If it was found, the estimated errors contain it.
  GainMismatch gain_mismatch = {};
  std::vector<double> error_per_level = {};  ///< estimated frobenius after each level; may be empty
  std::vector<double> error_per_level_half_width = {};
  NoiseCheck noise_check = {};
  std::vector<HeldOut> held_out = {};          ///< photographs that no part of the tensor was made from
  std::vector<std::int64_t> held_out_at = {};  ///< their numbers in the log
  std::int64_t suspects = 0;  ///< leaves that the held-out photographs find wrong and that stayed so
  double refine_seconds =
      0;  ///< of process_seconds: after the last photograph of the search (direct light, polish)
  /// In the order of the search. A level comes again where its leaves were split later, and in the next
  /// search for a target.
  std::vector<CaptureStep> steps = {};
  std::optional<CaptureForecast> forecast = {};  ///< the first one; none: nothing was held out
  std::optional<Undetermined> undetermined =
      {};  ///< none: the transport was data-sparse as far as tests tell
};

/// Measures T through the probe. The result is complete at any grid size, 1×1 included.
/// The first photographs are judged before the search: they must hold light that follows the patterns
/// (docs/errors.md, wrong_light). Algorithms without held-out photographs judge the flood-lit one alone.
/// fails: as settings_of and check_rig, before anything is measured; whatever the probe fails with; bad_value
/// if every photograph is invalid; wrong_light; limit; interrupted.
Result<CaptureResult> capture(Probe& probe, const CaptureOptions& options);

/// Judges a coaxial rig by seven photographs of its own, as capture() does by its first ones. Fewer than 256
/// pixels are lit one by one before: random patterns of so few do not tell their order.
/// fails: wrong_light; as the rig; interrupted.
Result<void> check_light_of_rig(Probe& rig, const Progress& progress = {});

/// Judges what a capture of a coaxial rig has not judged by itself: that of an algorithm without held-out
/// photographs, or of fewer than 256 pixels. The photographs of brute force show by themselves which one is
/// late, lost, mirrored or moved.
/// cost: as check_light_of_rig(), after the capture; none with max_seconds, without room in max_patterns, or
/// with unchecked.  fails: wrong_light; as the rig; interrupted.
Result<void> judge_light(Probe& rig, const CaptureOptions& options, const CaptureResult& result);

}  // namespace symrig
