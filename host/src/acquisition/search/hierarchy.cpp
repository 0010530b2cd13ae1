// SPDX-License-Identifier: Apache-2.0
// The loop of docs/architecture.md, "The search for T".
#include "acquisition/algorithms.hpp"
#include "acquisition/errors/checks.hpp"
#include "acquisition/light/light_check.hpp"
#include "acquisition/refine/merging.hpp"
#include "acquisition/search/brute_force_rest.hpp"
#include "acquisition/search/budget.hpp"
#include "acquisition/search/findings.hpp"
#include "acquisition/search/finishing.hpp"
#include "acquisition/search/forecasts.hpp"
#include "acquisition/search/level_search.hpp"
#include "acquisition/search/placement.hpp"
#include "acquisition/search/reopening.hpp"
#include "acquisition/search/short_range.hpp"
#include "acquisition/search/tolerance.hpp"
#include "acquisition/tree/node.hpp"
#include "symrig/acquisition/views.hpp"
#include "symrig/base/memory.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::acquisition {
namespace {

// Shares of a budget of seconds: what is planned for; of that the flood-lit photograph, and the checks.
constexpr double kPlanned = 0.98, kFloodShare = 1.0 / 12, kChecksShare = 1.0 / 6;

/// More photographs than any log holds.
constexpr std::size_t kEndless = std::size_t{1} << 40;

/// The algorithm of [Garg06 §5.2], with checks around it.
class Hierarchy {
 public:
  /// checks: of a search before this one, if there was one.
  Hierarchy(SearchFacts& facts, Photographer& photographer, const FloodLit& flood,
            std::optional<Checks> checks)
      : facts_(facts), photographer_(photographer), flood_(flood), checks_(std::move(checks)) {}

  /// plans_exposures: the rig asks for forecasts of its photographs.
  Result<CaptureResult> run(bool plans_exposures);

  /// The checks, for the next search.
  std::optional<Checks> take_checks_away() && { return std::move(checks_); }

 private:
  void place_root();
  Result<void> begin_forecast();
  Result<void> take_checks();
  Result<void> judge_light();
  void foretell();
  Result<void> search_and_mend();
  Result<void> search();
  Result<bool> finish_early();
  Result<void> search_level(int level);
  void report_step(int level);
  bool got_worse() const;
  void take_back(int level);
  void show(const CaptureSnapshot& so_far, bool direct);
  Result<CaptureResult> refine();
  static void withdraw_estimates(CaptureResult& result);
  Result<CaptureResult> measure_rest();
  void report(CaptureResult& result);

  const CaptureSettings& options() const { return facts_.options; }
  Checks* checks() { return checks_ ? &*checks_ : nullptr; }

  SearchFacts& facts_;
  Photographer& photographer_;
  const FloodLit& flood_;
  const bool may_be_finer_ = facts_.coarseness.steps > 0;
  Findings found_{facts_};
  Budget budget_{facts_.options, facts_.tree.grid().size(), photographer_};
  Sparseness sparseness_{facts_, photographer_, budget_};
  BudgetTolerance tolerance_{facts_, photographer_, found_};
  ShortRange short_range_{facts_, photographer_, found_};
  Reopening reopening_{facts_, photographer_, found_, budget_, sparseness_};
  std::optional<ExposureForecast> forecast_;  ///< of a rig that plans its exposures
  std::optional<Checks> checks_;
  std::optional<CaptureForecast> forecast_of_all_;
  std::vector<ErrorBar> error_per_level_;
  /// What the last level began with, until the checks have judged it.
  struct Before {
    KnownTransport::Mark mark;
    NodeLevel unknown;
    std::size_t level_light;  ///< number of Findings::level_light
  };
  std::optional<Before> before_;
  bool taken_back_ = false;    ///< the last level that was searched
  bool contradicted_ = false;  ///< by that level
  std::vector<CaptureStep> steps_;
  std::string stopped_by_ = "done";
};

Result<CaptureResult> Hierarchy::run(bool plans_exposures) {
  const Stopwatch watch;
  const double measured_before = photographer_.measure_seconds();
  const auto processed = [&] {
    return watch.seconds() - (photographer_.measure_seconds() - measured_before);
  };
  place_root();
  if (plans_exposures) SYMRIG_CHECK(begin_forecast());
  if (checks_) {  // of a search before this one
    checks_->forget();
  } else {
    SYMRIG_CHECK(take_checks());
    SYMRIG_CHECK(judge_light());
    if (options().before_search) SYMRIG_CHECK(options().before_search());
  }
  foretell();
  show({}, true);
  SYMRIG_CHECK(search_and_mend());
  const double searched = processed();
  const bool refines = !sparseness_.brute_force_takes_over();
  // A finer search is cheaper than brute force, and what was found wrong may be right there.
  const bool given_up = !refines && may_be_finer_ && stopped_by_ == "done";
  SYMRIG_TRY(CaptureResult result, refines ? refine() : given_up ? CaptureResult() : measure_rest());
  report(result);
  result.process_seconds = processed();
  if (refines) result.refine_seconds = result.process_seconds - searched;
  return result;
}

void Hierarchy::place_root() {
  found_.patterns_per_level.push_back(1);
  place(facts_, found_.known, found_.open[0], 0, 0,
        {flood_.image, {}, flood_.noise, flood_.noise, std::numeric_limits<double>::infinity()});
}

/// Photographs need not be known far below what a leaf may miss.
Result<void> Hierarchy::begin_forecast() {
  if (options().log == nullptr) return {};
  SYMRIG_TRY(Radiance flood, options().log->photograph(0));
  const ExposureGoal& goal = options().exposure;
  const double f = *std::max_element(facts_.flood_squared.begin(), facts_.flood_squared.end());
  if (!(f > 0)) return {};
  forecast_.emplace(facts_.tree, goal, flood,
                    goal.share_of_tolerance * options().rule.flood_fraction * std::sqrt(f));
  forecast_->coarsen(facts_.coarseness);
  photographer_.forecast_by(*forecast_);
  if (options().max_seconds > 0) tolerance_.shorten_exposures();
  return {};
}

/// A flood-lit photograph without light leaves nothing to search. The checks may say why.
Result<void> Hierarchy::take_checks() {
  const bool asks = found_.any_open() || !options().unchecked;
  if (!options().economy.checks || !asks || budget_.left() < Checks::kCount) return {};
  photographer_.seconds_left().may_spend(kChecksShare);
  SYMRIG_TRY(checks_, Checks::take(facts_.tree, photographer_));
  found_.patterns_per_level.back() += Checks::kCount;
  return {};
}

/// Before the search relies on the photographs.
Result<void> Hierarchy::judge_light() {
  if (options().unchecked) return {};
  std::optional<LightSeries> series;
  SYMRIG_CHECK(photographer_.read(0, 1, [&](std::int64_t, std::span<TreePhotograph> flood) {
    series.emplace(facts_.tree, flood[0], checks());
  }));
  return check_light(*series, options().look_aside);
}

/// What the capture will take, as far as the checks tell.
void Hierarchy::foretell() {
  if (!checks_) return;
  forecast_of_all_ =
      forecast_capture(facts_, *checks_, found_.known,
                       {photographer_.taken(), photographer_.rig_seconds(), checks_->seconds_each()});
  if (options().foretell) options().foretell(*forecast_of_all_);
}

/// Until all nodes are settled and no suspect can be reopened, or brute force has to measure the rest.
Result<void> Hierarchy::search_and_mend() {
  do {
    SYMRIG_CHECK(search());
    if (checks_ && !sparseness_.brute_force_takes_over()) reopening_.review(*checks_, stopped_by_ == "done");
  } while (found_.any_open() && !sparseness_.brute_force_takes_over());
  return {};
}

/// All levels with unknown nodes, coarse to fine.
Result<void> Hierarchy::search() {
  for (int level = 0; level < facts_.tree.levels(); ++level) {
    if (found_.open[level].nodes().empty()) continue;
    found_.gain.add(found_.open[level]);
    SYMRIG_TRY(const bool finished, finish_early());
    if (finished) return {};
    give_back_freed_memory();  // of the last level: blocks of this one have other sizes
    SYMRIG_CHECK(search_level(level));
    if (sparseness_.brute_force_takes_over()) break;
    report_step(level);
    if (got_worse()) {
      take_back(level);
      return {};
    }
    before_.reset();
  }
  before_.reset();  // its memory
  return {};
}

/// The checks miss the tensor by clearly more than before this level. Then its photographs contradict leaves
/// of coarser levels, and their light went to where none is: light that is balanced in all blocks (a
/// checkerboard) passes every test until single pixels are lit.
bool Hierarchy::got_worse() const {
  constexpr double kClearly = 2;
  if (!before_ || error_per_level_.size() < 2) return false;
  const ErrorBar &was = error_per_level_[error_per_level_.size() - 2], &is = error_per_level_.back();
  return is.value - is.half_width > kClearly * (was.value + was.half_width);
}

/// The level ends as it began, and so does the search.
void Hierarchy::take_back(int level) {
  found_.known.rewind(before_->mark);
  checks_->forget();  // what they have subtracted
  found_.level_light.resize(before_->level_light, LevelLight(0, {}, 0, 0));
  found_.close_all(facts_);
  found_.open[level] = std::move(before_->unknown);
  before_.reset();
  taken_back_ = true;
  contradicted_ = sparseness_.doubt_level();
  accept_open(facts_, found_, checks());
}

/// True if no further level is needed: all unknown light is direct or short-range, a budget is used up, or
/// the target error is reached.
Result<bool> Hierarchy::finish_early() {
  if (checks_) {
    const std::int64_t before = photographer_.taken();
    SYMRIG_TRY(const bool settled, short_range_.settle(*checks_, budget_.left()));
    found_.patterns_per_level.back() += photographer_.taken() - before;
    if (settled) return true;
  }
  const bool reached =
      options().target_error > 0 && !error_per_level_.empty() &&
      error_per_level_.back().value + error_per_level_.back().half_width <= options().target_error;
  const Budget::Limit budget = budget_.tightest();
  if (!reached && budget.left > 0) return false;
  if (reached)
    stopped_by_ = "target_error";
  else if (!budget_.reopening())
    stopped_by_ = budget.name;
  accept_open(facts_, found_, checks());
  return true;
}

Result<void> Hierarchy::search_level(int level) {
  const std::size_t at = level;
  const bool last = level + 1 == facts_.tree.levels();
  NodeLevel unknown = std::move(found_.open[at]);
  found_.open[at] = NodeLevel(facts_.tree, level, facts_.channels);
  found_.patterns_per_level.resize(std::max(found_.patterns_per_level.size(), at + 2));
  const KnownTransport::Mark mark = found_.known.mark();
  const std::size_t level_light = found_.level_light.size();
  LevelSearch search(facts_, photographer_, found_, unknown);
  search.ask_first([&](std::int64_t photographs, std::int64_t later) {
    return sparseness_.worth_searching(level, photographs, later);
  });
  const double pace = tolerance_.pace();
  const bool can_take_over = sparseness_.can_take_over();
  const auto limit = [&] {
    const double from_now = search.photographs() > 0 ? 1 : pace;
    return can_take_over ? budget_.of_user(from_now) : budget_.tightest(from_now);
  };
  // A round that the clock breaks off leaves out whatever comes last. One that is planned to be shorter
  // leaves out what promises most, and another round uses what is left.
  const auto surely_left = [&] {
    constexpr double kSurely = 0.85;
    const Budget::Limit now = limit();
    const bool seconds = std::string_view(now.name) == "max_seconds";
    return seconds ? static_cast<std::int64_t>(kSurely * static_cast<double>(now.left)) : now.left;
  };
  const char* const limited_by = limit().name;
  if (forecast_) forecast_->coarsen(tolerance_.of_exposures());
  if (!budget_.reopening()) budget_.begin_pace();
  SYMRIG_TRY(std::vector<Tested> tested, search.run(surely_left));
  if (search.given_up()) {
    found_.open[at] = std::move(unknown);
    accept_open(facts_, found_, checks());
    return {};
  }
  sparseness_.add(search.evidence(tested));
  if (search.cut_short() && !budget_.reopening()) stopped_by_ = limited_by;
  NodeLevel none(facts_.tree, level, facts_.channels);  // single pixels have no children
  if (last || budget_.reopening())
    settle(facts_, found_.known, unknown, tested, last ? none : found_.open[at + 1]);
  else
    tolerance_.settle(search, unknown, std::move(tested), found_.open[at + 1],
                      [&](double pace_there) { return budget_.of_user(pace_there).left; });
  if (tolerance_.raised() && !budget_.reopening()) stopped_by_ = budget_.of_user().name;
  if (checks_ && !budget_.reopening()) {
    unknown.drop_evidence();
    before_ = Before{mark, std::move(unknown), level_light};
  }
  return {};
}

void Hierarchy::report_step(int level) {
  CaptureStep step{level, photographer_.taken(), photographer_.rig_seconds(), std::nullopt};
  std::optional<double> half_width;
  bool direct = true;
  if (checks_) {
    const Assumption assumed = better_assumption(facts_, found_, *checks_);
    direct = assumed.direct;
    error_per_level_.push_back(assumed.error);
    step.error = assumed.error.value;
    sparseness_.misses_of_all(assumed.error.value);
    half_width = assumed.error.half_width;
  }
  steps_.push_back(step);
  show({.step = step, .half_width = half_width, .tensor = {}}, direct);
}

/// Hands the search so far to who watches it. The copy is finished elsewhere, so the search hardly waits.
void Hierarchy::show(const CaptureSnapshot& so_far, bool direct) {
  if (!options().watch) return;
  CaptureSnapshot snapshot = so_far;
  const auto draft = std::make_shared<TensorBuilder>(assumed_draft(facts_, found_, direct));
  snapshot.tensor = [draft] { return std::move(*draft).finish(); };
  options().watch(snapshot);
}

Result<CaptureResult> Hierarchy::refine() {
  Finishing finishing(facts_, photographer_, found_, checks());
  budget_.end_reopening();
  tolerance_.keep_coarsest();
  if (!taken_back_) {  // else photographs of the last level would spoil what they contradict
    SYMRIG_CHECK(finishing.refit_direct_light(
        {.noisy = flood_.noisy, .reopened = reopening_.changed(), .budget = budget_.left()}));
    SYMRIG_CHECK(finishing.polish());
  }
  options().work.begin("merging leaves");
  merge_leaves(facts_, found_.known);
  // Estimates read a few photographs at a time. A tensor is twice in memory while it is finished.
  photographer_.free_pool();
  give_back_freed_memory();
  options().work.begin("packing the tensor");
  TensorBuilder draft = found_.known.draft();
  found_.known.release();
  CaptureResult result;
  result.tensor = std::move(draft).finish();
  if (!checks_) return result;
  SYMRIG_CHECK(finishing.estimate(result.tensor, nullptr, result));
  SYMRIG_CHECK(finishing.make_sure(budget_.left(), result));
  if (contradicted_) withdraw_estimates(result);
  SYMRIG_TRY(result.held_out, checks_->held_out(facts_.tree, photographer_));
  for (const LogRange& range : checks_->ranges())
    for (std::int64_t k = range.first; k < range.last; ++k) result.held_out_at.push_back(k);
  return result;
}

/// Light that is balanced in all blocks hides from the checks as well, so they cannot tell what is missed.
void Hierarchy::withdraw_estimates(CaptureResult& result) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  struct Kind {
    const char* key;
    double TransportErrors::*error;
  };
  for (const Kind& kind :
       {Kind{"frobenius", &TransportErrors::frobenius}, Kind{"indirect", &TransportErrors::indirect},
        Kind{"relight.random", &TransportErrors::relight_random},
        Kind{"relight.natural", &TransportErrors::relight_natural}}) {
    (*result.estimated).*kind.error = result.estimated_half_width.*kind.error = kNone;
    std::erase_if(result.estimate_not_given, [&](const ErrorNotGiven& one) { return one.key == kind.key; });
    result.estimate_not_given.push_back({kind.key, Sparseness::kContradiction});
  }
}

/// Brute force for the rest. The checks estimate the errors of a tensor that they are no part of. Then they
/// go into the tensor that is kept.
Result<CaptureResult> Hierarchy::measure_rest() {
  const TransportTensor searched = found_.known.tensor();
  const std::int64_t before = photographer_.taken();
  SYMRIG_TRY(const BruteForceRest rest, BruteForceRest::take(facts_, photographer_, searched));
  CaptureResult result;
  if (checks_) {
    SYMRIG_TRY(const TransportTensor without,
               rest.tensor(facts_.tree, photographer_, remaining(checks_->ranges(), before)));
    const Finishing finishing(facts_, photographer_, found_, checks());
    SYMRIG_CHECK(finishing.estimate(without, &rest, result));
  }
  SYMRIG_TRY(result.tensor, rest.tensor(facts_.tree, photographer_, {{0, before}}));
  found_.patterns_per_level.push_back(photographer_.taken() - before);
  return result;
}

/// How the search went, whichever way it ended.
void Hierarchy::report(CaptureResult& result) {
  result.patterns = photographer_.taken();
  result.patterns_per_level = std::move(found_.patterns_per_level);
  result.stopped_by = stopped_by_;
  result.tolerance = options().rule.flood_fraction * facts_.coarseness.factor();
  result.suspects = reopening_.suspects();
  for (const ErrorBar& error : error_per_level_) {
    result.error_per_level.push_back(error.value);
    result.error_per_level_half_width.push_back(error.half_width);
  }
  result.steps = std::move(steps_);
  result.forecast = forecast_of_all_;
  result.undetermined = std::move(sparseness_).finding();
}

/// One search after another, as one capture. patterns_per_level: the flood-lit photograph counts once.
CaptureResult joined(const CaptureResult& before, CaptureResult last) {
  const auto join = [](const auto& first, auto& second) {
    second.insert(second.begin(), first.begin(), first.end());
  };
  std::vector<std::int64_t>& patterns = last.patterns_per_level;
  if (!before.patterns_per_level.empty()) --patterns[0];
  patterns.resize(std::max(patterns.size(), before.patterns_per_level.size()));
  for (std::size_t k = 0; k < before.patterns_per_level.size(); ++k)
    patterns[k] += before.patterns_per_level[k];
  join(before.steps, last.steps);
  join(before.error_per_level, last.error_per_level);
  join(before.error_per_level_half_width, last.error_per_level_half_width);
  if (before.forecast) last.forecast = before.forecast;
  last.process_seconds += before.process_seconds;
  last.refine_seconds += before.refine_seconds;
  return last;
}

/// begun: has taken the flood-lit photograph, as number 0 of options.log.
Result<CaptureResult> search_tree(Probe& probe, const CaptureSettings& options, const BlockTree& tree,
                                  const Photographer& begun) {
  Photographer photographer(begun, tree);
  SYMRIG_TRY(const FloodLit flood, FloodLit::read(photographer, probe.channels()));
  TargetTolerance target(options);
  std::optional<Checks> checks;
  CaptureResult result;
  for (bool again = true; again;) {
    SearchFacts facts{
        options, tree, probe.channels(), flood.squared, probe.residual_shift(), target.coarseness()};
    Hierarchy search(facts, photographer, flood, std::move(checks));
    SYMRIG_TRY(CaptureResult found, search.run(probe.plans_exposures(kEndless)));
    again = target.search_again(found);
    if (!again && target.coarseness().steps > 0 && target.reached(found)) found.stopped_by = "target_error";
    result = joined(result, std::move(found));
    checks = std::move(search).take_checks_away();
  }
  return result;
}

/// Nothing is known in less time than the first photograph takes.
Result<void> check_begun_in_time(const CaptureSettings& options, double rig_seconds) {
  if (options.max_seconds == 0 || rig_seconds <= options.max_seconds) return {};
  return Error{ErrorCode::limit,
               fmt::format("max_seconds {:.3g} is too little: the rig has taken {:.3g} s until its first "
                           "photograph, so nothing is known of the scene",
                           options.max_seconds, rig_seconds),
               fmt::format("give {:.2g} s or more", 10 * rig_seconds)};
}

/// One view has one tree. For several views, the flood-lit photograph chooses how the tree cuts them.
Result<CaptureResult> capture_logged(Probe& probe, const CaptureSettings& options) {
  const BlockTree flat(probe.grid());
  Photographer photographer(probe, options.log, flat, options.work);
  const std::vector<LitBlocks> flood{{{0, static_cast<std::int32_t>(probe.grid().size())}}};
  const FirstLook first_look;
  photographer.forecast_by(first_look);
  if (options.max_seconds > 0) photographer.seconds_left().end_by(kPlanned * options.max_seconds);
  photographer.seconds_left().may_spend(kFloodShare);
  SYMRIG_CHECK(photographer.take("flood-lit", flood));
  SYMRIG_CHECK(check_begun_in_time(options, photographer.rig_seconds()));
  if (!algorithm_info(options.algorithm).splits_views || probe.views().count() == 1)
    return search_tree(probe, options, flat, photographer);
  SYMRIG_TRY(const Radiance photograph, options.log->photograph(0));
  SYMRIG_TRY(const Split split, choose_split(photograph, probe.views(), options.split));
  SYMRIG_TRY(const BlockTree tree, BlockTree::make(probe.grid(), split));
  return search_tree(probe, options, tree, photographer);
}

}  // namespace

Result<CaptureResult> capture_hierarchy(Probe& probe, const CaptureSettings& options) {
  if (options.log != nullptr) return capture_logged(probe, options);
  const auto log = make_memory_log(probe.grid(), probe.channels());
  LoggedProbe logged(probe, *log, probe.together());
  CaptureSettings with_log = options;
  with_log.log = log.get();
  return capture_logged(logged, with_log);
}

}  // namespace symrig::acquisition
