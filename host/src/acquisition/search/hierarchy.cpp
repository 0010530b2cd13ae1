// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/hierarchy.hpp"

#include "acquisition/capture_noise.hpp"
#include "acquisition/errors/checks.hpp"
#include "acquisition/errors/dark_excess.hpp"
#include "acquisition/errors/error_estimate.hpp"
#include "acquisition/errors/noise_check.hpp"
#include "acquisition/refine/direct_light.hpp"
#include "acquisition/refine/merging.hpp"
#include "acquisition/refine/polish.hpp"
#include "acquisition/search/completion.hpp"
#include "acquisition/search/context.hpp"
#include "acquisition/search/forecast.hpp"
#include "acquisition/search/level_search.hpp"
#include "acquisition/search/node.hpp"
#include "acquisition/search/placement.hpp"
#include "acquisition/search/prediction.hpp"
#include "acquisition/search/short_range.hpp"
#include "acquisition/search/suspects.hpp"
#include "symrig/acquisition/views.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string>

namespace symrig::acquisition {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// More photographs than any log holds.
constexpr std::size_t kEndless = std::size_t{1} << 40;

constexpr const char* kWrongLeaves = "held-out photographs find leaves wrong that passed their tests";

class Hierarchy {
 public:
  /// begun: the flood-lit photograph has been taken, as number 0 of options.log.
  Hierarchy(Probe& probe, const CaptureSettings& options, BlockTree tree, const Photographer& begun)
      : options_(options),
        tree_(std::move(tree)),
        photographer_(begun, tree_),
        known_(tree_, probe.channels()),
        context_{options, tree_, probe.channels(), photographer_, known_, {}, {}},
        plans_exposures_(probe.plans_exposures(kEndless)),
        decay_(options.economy.decay) {
    for (int l = 0; l < tree_.levels(); ++l) open_.emplace_back(tree_, l, probe.channels());
  }

  /// The algorithm of [Garg06 §5.2], with checks around it.
  Result<CaptureResult> run() {
    const auto start = std::chrono::steady_clock::now();
    const double measured_before = photographer_.measure_seconds();  // for the outline
    const auto processed = [&] {
      return seconds_since(start) - (photographer_.measure_seconds() - measured_before);
    };
    SYMRIG_CHECK(begin());
    SYMRIG_CHECK(begin_forecast());
    if (options_.economy.checks && any_open() && patterns_left() >= Checks::kCount) {
      SYMRIG_TRY(checks_, Checks::take(context_));
    }
    do {
      SYMRIG_CHECK(search());
      if (completing()) break;
      reopen_suspects();
    } while (any_open() && !completing());
    if (completing()) {
      SYMRIG_TRY(CaptureResult result, complete());
      result.process_seconds = processed();
      return result;
    }
    const double searched = processed();
    SYMRIG_CHECK(refine_direct_light());
    SYMRIG_CHECK(polish());
    merge_leaves(context_);
    SYMRIG_TRY(CaptureResult result, finish());
    result.process_seconds = processed();
    result.refine_seconds = result.process_seconds - searched;
    return result;
  }

 private:
  Result<void> begin();
  Result<void> begin_forecast();
  Result<void> search();
  Result<void> search_level(int level);
  Result<bool> finish_early();
  void tell_step(int level);
  void reopen_suspects();
  void put_back();
  Result<void> refine_direct_light();
  std::vector<LogRange> whole_photographs() const;
  Result<void> polish();
  std::int64_t dense_levels(int level) const;
  bool unstructured() const;
  bool can_complete() const;
  bool worth_searching(int level, std::int64_t photographs, std::int64_t later);
  bool doubt(std::string reason, std::int64_t forecast);
  bool completing() const { return undetermined_ && undetermined_->completed; }
  std::int64_t brute_force_left() const { return tree_.grid().size() - photographer_.taken(); }
  Result<CaptureResult> complete();
  Result<void> estimate(const TransportTensor& tensor, const Completion* completion,
                        CaptureResult& result) const;
  Result<CaptureResult> finish();
  void tell_result(CaptureResult& result);

  bool any_open() const {
    return std::any_of(open_.begin(), open_.end(),
                       [](const NodeLevel& level) { return !level.nodes().empty(); });
  }
  struct Budget {
    std::int64_t left = std::numeric_limits<std::int64_t>::max();  ///< photographs
    const char* name = "done";                                     ///< what CaptureResult::stopped_by says

    void tighten(std::int64_t photographs, const char* by) {
      if (photographs < left) *this = {std::max<std::int64_t>(0, photographs), by};
    }
  };
  Budget user_budget() const;
  Budget tightest_budget() const;
  std::int64_t patterns_left() const { return tightest_budget().left; }
  void accept_open();
  void assume_pairs();
  void assume_diagonal(bool direct);
  /// What is assumed of blocks that were not looked into, and the estimated frobenius error with it.
  struct Assumption {
    bool direct = true;
    ErrorBar error;
  };
  Assumption better_assumption();

  const CaptureSettings& options_;
  BlockTree tree_;
  Photographer photographer_;
  Known known_;
  Context context_;
  bool plans_exposures_;
  Decay decay_;
  std::vector<NodeLevel> open_;       ///< unknown nodes, by level
  std::optional<Forecast> forecast_;  ///< where the rig plans its exposures
  std::optional<Checks> checks_;
  bool noisy_ = false;                           ///< photographs have a variance
  std::optional<std::int64_t> reopening_until_;  ///< photographs, once the search is over
  std::int64_t reopened_at_ = -1;                ///< photographs taken when leaves were reopened last
  std::int64_t suspects_ = 0;
  /// Leaves that were reopened last.
  struct Reopening {
    Known::Mark mark;  ///< of what was known then
    std::vector<std::int32_t> leaves;
    Comparison seen;          ///< by the checks then, where they are dark
    std::size_t level_light;  ///< Context::level_light then
  };
  std::optional<Reopening> reopening_;
  bool reopened_ = false;  ///< some were, and stayed so
  std::set<int> refused_radii_;
  std::vector<ErrorBar> error_per_level_;
  std::vector<CaptureStep> steps_;
  std::int64_t first_again_ = 0;  ///< log number of the flood-lit photographs at the end
  std::string stopped_by_ = "done";
  std::vector<LevelEvidence> evidence_;
  std::optional<Undetermined> undetermined_;
};

/// The flood-lit photograph is the root's estimate: c = r = T 1. F is its RMS, the signal that tolerances
/// refer to.
Result<void> Hierarchy::begin() {
  const auto pixels = static_cast<std::size_t>(tree_.grid().size());
  TreePhotograph flood;
  SYMRIG_CHECK(
      photographer_.read(0, 1, [&](std::int64_t, std::span<TreePhotograph> p) { flood = std::move(p[0]); }));
  context_.patterns_per_level.push_back(1);
  std::vector<PairNoise> noise(static_cast<std::size_t>(context_.channels));
  bool any = false;
  for (std::size_t channel = 0; channel < noise.size(); ++channel) {
    double squares = 0;
    for (std::size_t t = channel * pixels; t < (channel + 1) * pixels; ++t) {
      if (flood.valid[t] == 0) continue;
      squares += static_cast<double>(flood.mean[t]) * static_cast<double>(flood.mean[t]);
      noise[channel].variance += flood.variance[t];
      noisy_ = noisy_ || flood.variance[t] > 0;
      ++noise[channel].valid;
    }
    any = any || noise[channel].valid > 0;
    context_.flood_squared.push_back(noise[channel].valid > 0 ? squares / noise[channel].valid : 0);
  }
  if (!any)
    return Error{ErrorCode::bad_value, "every pixel of the flood-lit photograph is invalid",
                 "shorten the exposures or look for a cap on the lens"};
  place(context_, open_[0], 0, 0, {flood.mean, {}, noise, noise, std::numeric_limits<double>::infinity()});
  return {};
}

/// Tells a rig that can choose its exposures what to expect. Noise is of no interest far below what a leaf
/// may miss.
Result<void> Hierarchy::begin_forecast() {
  if (!plans_exposures_ || options_.log == nullptr) return {};
  SYMRIG_TRY(Radiance flood, options_.log->photograph(0));
  const ExposureGoal& goal = options_.exposure;
  const double f = *std::max_element(context_.flood_squared.begin(), context_.flood_squared.end());
  if (!(f > 0)) return {};
  forecast_.emplace(tree_, goal, flood, goal.share_of_tolerance * std::sqrt(context_.tolerance() * f));
  photographer_.forecast_by(*forecast_);
  return {};
}

/// From the coarsest level with unknown nodes down, until none are left or a budget or target ends it.
Result<void> Hierarchy::search() {
  for (int level = 0; level < tree_.levels(); ++level) {
    if (open_[static_cast<std::size_t>(level)].nodes().empty()) continue;
    SYMRIG_TRY(const bool finished, finish_early());
    if (finished) return {};
    SYMRIG_CHECK(search_level(level));
    if (completing()) return {};
    tell_step(level);
  }
  return {};
}

Result<void> Hierarchy::search_level(int level) {
  NodeLevel unknown = std::move(open_[static_cast<std::size_t>(level)]);
  open_[static_cast<std::size_t>(level)] = NodeLevel(tree_, level, context_.channels);
  while (std::ssize(context_.patterns_per_level) < level + 2) context_.patterns_per_level.push_back(0);
  LevelSearch search(context_, decay_, unknown);
  // Where brute force can take over, no round is cut short to what is left of it.
  const bool whole_rounds = options_.algorithm == Algorithm::symrig && !undetermined_ && can_complete();
  const Budget budget = whole_rounds ? user_budget() : tightest_budget();
  search.ask_first([&](std::int64_t photographs, std::int64_t later) {
    return worth_searching(level, photographs, later);
  });
  SYMRIG_TRY(const std::vector<Tested> tested, search.run(budget.left));
  if (search.given_up()) {
    open_[static_cast<std::size_t>(level)] = std::move(unknown);
    accept_open();
    return {};
  }
  evidence_.push_back(search.evidence(tested));
  if (search.cut_short() && !reopening_until_) stopped_by_ = budget.name;
  NodeLevel leftovers(tree_, std::min(level + 1, tree_.levels() - 1), context_.channels);
  settle(context_, unknown, tested,
         level + 1 < tree_.levels() ? open_[static_cast<std::size_t>(level) + 1] : leftovers);
  return {};
}

/// Photographs of all levels from this one on if no pair of blocks is a leaf and no two share a photograph.
std::int64_t Hierarchy::dense_levels(int level) const {
  std::int64_t photographs = 0;
  for (int l = level; l + 1 < tree_.levels(); ++l) photographs += std::ssize(tree_.level(l + 1));
  return photographs;
}

/// No product explains any pair of blocks that the last level tested. Where no light is negative and blocks
/// are equal, c r'/s leaves 3/4 of the energy at most; half way from there to all of it nothing is explained.
bool Hierarchy::unstructured() const {
  constexpr std::int64_t kFewest = 6;  // pairs: those of four blocks
  constexpr double kNothing = 7.0 / 8;
  if (evidence_.empty()) return false;
  const LevelEvidence& last = evidence_.back();
  return last.tested >= kFewest && last.leaves == 0 && last.unexplained > kNothing;
}

/// Brute force fits into the budgets and into memory.
bool Hierarchy::can_complete() const {
  return Completion::bytes(tree_.grid().size(), context_.channels) <= options_.memory_limit &&
         user_budget().left >= brute_force_left();
}

/// False, with the evidence, if the level is better left to brute force. photographs: of its next round;
/// later: of the levels after it, at least.
bool Hierarchy::worth_searching(int level, std::int64_t photographs, std::int64_t later) {
  if (options_.algorithm != Algorithm::symrig) return true;
  const std::int64_t taken = photographer_.taken();
  if (reopening_until_) {
    if (photographs <= std::min(*reopening_until_ - taken, brute_force_left())) return true;
    return !doubt(kWrongLeaves, taken + photographs);
  }
  const std::int64_t dense = taken + dense_levels(level);
  if (unstructured() && dense > tree_.grid().size())
    return !doubt("no pair of blocks is explained by a product of two pictures", dense);
  if (photographs + later <= brute_force_left()) return true;
  return !doubt("too few pairs of blocks are explained by a product of two pictures",
                taken + photographs + later);
}

/// True if brute force completes the capture.
bool Hierarchy::doubt(std::string reason, std::int64_t forecast) {
  if (undetermined_) return false;  // it has been told, and brute force is in the way of a budget
  undetermined_ = Undetermined{.reason = std::move(reason),
                               .patterns = photographer_.taken(),
                               .forecast = forecast,
                               .brute_force = tree_.grid().size(),
                               .completed = can_complete(),
                               .levels = evidence_};
  return undetermined_->completed;
}

/// Brute force for the rest. The held-out photographs tell the errors of a tensor that they are no part of,
/// and then go into the one that is kept.
Result<CaptureResult> Hierarchy::complete() {
  const TransportTensor searched = known_.tensor();
  const std::int64_t before = photographer_.taken();
  SYMRIG_TRY(const Completion completion, Completion::take(context_, searched));
  CaptureResult result;
  if (checks_) {
    SYMRIG_TRY(const TransportTensor without,
               completion.tensor(context_, {{0, checks_->first()}, {checks_->last(), before}}));
    SYMRIG_CHECK(estimate(without, &completion, result));
  }
  SYMRIG_TRY(result.tensor, completion.tensor(context_, {{0, before}}));
  context_.patterns_per_level.push_back(photographer_.taken() - before);
  tell_result(result);
  return result;
}

/// What was asked for: the budget that leaves the fewest photographs.
Hierarchy::Budget Hierarchy::user_budget() const {
  Budget tightest;
  if (options_.max_patterns > 0)
    tightest.tighten(options_.max_patterns - photographer_.taken(), "max_patterns");
  if (options_.max_seconds > 0) {
    const double spent = photographer_.rig_seconds();
    const double each = spent / static_cast<double>(std::max<std::int64_t>(1, photographer_.taken()));
    const double more = each > 0 ? (options_.max_seconds - spent) / each : 0;
    tightest.tighten(static_cast<std::int64_t>(std::clamp(more, 0.0, 1e15)), "max_seconds");
  }
  return tightest;
}

/// The same with what nobody has to ask for: no more photographs than brute force, and few for mending. What
/// mending may cost is no budget of the user's: a search that it ends is done.
Hierarchy::Budget Hierarchy::tightest_budget() const {
  Budget tightest = user_budget();
  if (options_.algorithm == Algorithm::symrig) tightest.tighten(brute_force_left(), "brute_force");
  if (reopening_until_) tightest.tighten(*reopening_until_ - photographer_.taken(), "done");
  return tightest;
}

/// True if what is still unknown is settled without further levels: it is all direct or short-range light, a
/// budget is used up, or the target is reached.
Result<bool> Hierarchy::finish_early() {
  if (checks_) {
    SYMRIG_TRY(const bool short_range,
               settle_short_range(context_, *checks_, open_, patterns_left(), refused_radii_));
    if (short_range) return true;
  }
  const bool reached =
      options_.target_error > 0 && !error_per_level_.empty() &&
      error_per_level_.back().value + error_per_level_.back().half_width <= options_.target_error;
  const Budget budget = tightest_budget();
  if (!reached && budget.left > 0) return false;
  if (reached)
    stopped_by_ = "target_error";
  else if (!reopening_until_)
    stopped_by_ = budget.name;
  accept_open();
  return true;
}

/// A pair of blocks that is still unknown becomes what its images say.
void Hierarchy::assume_pairs() {
  for (const NodeLevel& level : open_)
    for (const Node& node : level.nodes())
      if (!node.diagonal()) add_leaf(context_, level, node);
}

/// A block with itself becomes all direct light, or what its image says too.
void Hierarchy::assume_diagonal(bool direct) {
  for (const NodeLevel& level : open_)
    for (const Node& node : level.nodes())
      if (node.diagonal()) direct ? add_direct(context_, level, node) : void(add_leaf(context_, level, node));
}

/// The error if the search ended here, by the better of the two assumptions.
Hierarchy::Assumption Hierarchy::better_assumption() {
  checks_->residuals(context_);
  const Known::Mark searched = known_.mark();
  assume_pairs();
  std::vector<TreePhotograph> without_pairs = checks_->halves();
  known_.subtract_from(without_pairs, searched);
  const Known::Mark pairs = known_.mark();
  Assumption best;
  for (const bool direct : {true, false}) {
    assume_diagonal(direct);
    std::vector<TreePhotograph> left = without_pairs;
    known_.subtract_from(left, pairs);
    known_.rewind(pairs);
    const ErrorBar error = frobenius_error(tree_, checks_->photographs(), left);
    if (direct || error.value < best.error.value) best = {direct, error};
  }
  known_.rewind(searched);
  return best;
}

/// The tensor is complete at any moment.
void Hierarchy::accept_open() {
  const bool direct = !checks_ || better_assumption().direct;
  assume_pairs();
  assume_diagonal(direct);
  for (NodeLevel& level : open_) level = NodeLevel(tree_, level.level(), context_.channels);
}

void Hierarchy::tell_step(int level) {
  CaptureStep step{level, photographer_.taken(), photographer_.rig_seconds(), std::nullopt};
  if (checks_) {
    error_per_level_.push_back(better_assumption().error);
    step.error = error_per_level_.back().value;
  }
  steps_.push_back(step);
}

/// Leaves that the checks find wrong are split, as long as that costs little: a tenth of the photographs
/// taken so far. Where it costs more, brute force takes over (worth_searching). If the checks are missed by
/// more than before, for instance because small blocks measure mostly noise, the leaves are put back. What
/// remains is told (CaptureResult::suspects, the estimated errors).
void Hierarchy::reopen_suspects() {
  // A pattern that deceives all blocks looks no better until single pixels are told apart.
  constexpr double kWorse = 0.01;
  if (!checks_) return;
  const auto& residuals = checks_->residuals(context_);
  const Comparison seen = DarkExcess(Checks::random(residuals), context_.flood_squared)
                              .of(0, static_cast<std::int32_t>(tree_.grid().size()));
  if (reopening_ && seen.misfit - reopening_->seen.misfit > kWorse * reopening_->seen.excess())
    return put_back();
  reopened_ = reopened_ || reopening_;
  reopening_.reset();
  if (stopped_by_ != "done") return;
  const std::vector<std::int32_t> found = suspects(context_, residuals);
  suspects_ = std::ssize(found);
  if (!reopening_until_) reopening_until_ = photographer_.taken() + photographer_.taken() / 10;
  if (found.empty()) return;
  // What is left of the budget may be too little for a single leaf: then they would come back for ever.
  if (patterns_left() <= 0 || reopened_at_ == photographer_.taken()) {
    doubt(kWrongLeaves, photographer_.taken());
    return;
  }
  reopened_at_ = photographer_.taken();
  reopening_ = Reopening{known_.mark(), found, seen, context_.level_light.size()};
  for (const std::int32_t leaf : found)
    reopen(context_, leaf,
           open_[static_cast<std::size_t>(known_.leaves()[static_cast<std::size_t>(leaf)].level)]);
}

void Hierarchy::put_back() {
  known_.rewind(reopening_->mark);
  for (const std::int32_t leaf : reopening_->leaves) known_.restore_leaf(leaf);
  context_.level_light.resize(reopening_->level_light, LevelLight(0, {}, 0, 0));
  reopening_.reset();
}

/// Spends a few flood-lit photographs on the noise of the direct light, then refits it to all photographs but
/// the checks.
Result<void> Hierarchy::refine_direct_light() {
  if (options_.economy.direct_share <= 0 || known_.scalars().empty()) return {};
  constexpr std::int64_t kFewest = 4;
  const auto pixels = static_cast<std::int32_t>(tree_.grid().size());
  const auto share =
      static_cast<std::int64_t>(options_.economy.direct_share * static_cast<double>(photographer_.taken()));
  reopening_until_.reset();
  const auto extra =
      static_cast<std::size_t>(std::min(noisy_ ? std::max(kFewest, share) : 0, patterns_left()));
  photographer_.expect_later(kNoneToCome);
  first_again_ = photographer_.taken();
  SYMRIG_CHECK(photographer_.take("direct light", std::vector<LitBlocks>(extra, LitBlocks{{0, pixels}})));
  context_.patterns_per_level.push_back(static_cast<std::int64_t>(extra));
  DirectLight::Model model{{}, std::vector<double>(context_.flood_squared.size())};
  for (const double f : context_.flood_squared) model.least.push_back(context_.tolerance() * f);
  if (checks_) {
    const auto& residuals = checks_->residuals(context_);
    model.half = Checks::misfit_of_half(residuals);
  }
  DirectLight direct(known_, static_cast<std::size_t>(pixels), std::move(model));
  if (!reopened_) {
    const LaterLight later(known_, tree_, context_.channels);
    for (const LevelLight& level : context_.level_light) direct.add(level, later, known_);
  }
  for (const LogRange& range : whole_photographs())
    SYMRIG_CHECK(photographer_.read(range.first, range.last - range.first,
                                    [&](std::int64_t, std::span<TreePhotograph> photographs) {
                                      known_.subtract_from(photographs);
                                      direct.add(photographs);
                                    }));
  direct.apply(known_);
  return {};
}

/// Photographs that the direct light is refitted to as a whole: all but the checks and, unless leaves were
/// reopened (which changes what was subtracted at the time), those of which LevelLight holds what matters.
std::vector<LogRange> Hierarchy::whole_photographs() const {
  std::vector<LogRange> left_out;
  if (checks_) left_out.push_back({checks_->first(), checks_->last()});
  if (!reopened_)
    for (const LevelLight& level : context_.level_light) left_out.push_back(level.photographs);
  std::vector<LogRange> whole;
  std::int64_t next = 0;
  for (const LogRange& out : left_out) {
    if (out.first > next) whole.push_back({next, out.first});
    next = out.last;
  }
  if (photographer_.taken() > next) whole.push_back({next, photographer_.taken()});
  return whole;
}

Result<void> Hierarchy::polish() {
  if (options_.economy.polish <= 0) return {};
  std::vector<LogRange> ranges{{0, photographer_.taken()}};
  if (checks_) ranges = {{0, checks_->first()}, {checks_->last(), photographer_.taken()}};
  constexpr int kConjugateSteps = 8;
  std::vector<double> misfit;
  for (const double f : context_.flood_squared) misfit.push_back(context_.tolerance() * f);
  Polish polish(context_, std::move(ranges), std::move(misfit));
  for (int k = 0; k < options_.economy.polish; ++k) {
    SYMRIG_TRY(const Polish::Outcome outcome, polish.step(kConjugateSteps));
    if (outcome.after >= outcome.before) break;
  }
  return {};
}

/// The errors of a tensor that the checks are no part of, and whether photographs scatter as they say.
Result<void> Hierarchy::estimate(const TransportTensor& tensor, const Completion* completion,
                                 CaptureResult& result) const {
  SYMRIG_TRY(result.noise_check, check_noise(context_, *checks_, first_again_, completion));
  ErrorEstimate estimate =
      estimate_errors(tensor, checks_->photographs(), doubted_variance(result.noise_check));
  result.estimated = estimate.value;
  result.estimated_half_width = estimate.half_width;
  result.estimate_not_given = std::move(estimate.not_given);
  return {};
}

Result<CaptureResult> Hierarchy::finish() {
  CaptureResult result;
  result.tensor = known_.tensor();
  if (checks_) {
    SYMRIG_CHECK(estimate(result.tensor, nullptr, result));
    result.held_out = checks_->held_out(context_);
  }
  tell_result(result);
  return result;
}

/// What the search says of itself, whichever way it ended.
void Hierarchy::tell_result(CaptureResult& result) {
  result.patterns = photographer_.taken();
  result.patterns_per_level = std::move(context_.patterns_per_level);
  result.stopped_by = stopped_by_;
  result.suspects = suspects_;
  for (const ErrorBar& error : error_per_level_) {
    result.error_per_level.push_back(error.value);
    result.error_per_level_half_width.push_back(error.half_width);
  }
  result.steps = std::move(steps_);
  result.undetermined = std::move(undetermined_);
}

}  // namespace

namespace {

Result<CaptureResult> capture_logged(Probe& probe, const CaptureSettings& options) {
  const BlockTree flat(probe.grid());
  Photographer photographer(probe, options.log, flat, options.progress);
  const std::vector<LitBlocks> flood{{{0, static_cast<std::int32_t>(probe.grid().size())}}};
  SYMRIG_CHECK(photographer.take("flood-lit", flood));
  if (options.algorithm != Algorithm::symrig || probe.views().count() == 1)
    return Hierarchy(probe, options, flat, photographer).run();
  SYMRIG_TRY(const Radiance photograph, options.log->photograph(0));
  SYMRIG_TRY(const Split split, choose_split(photograph, probe.views(), options.split));
  SYMRIG_TRY(BlockTree tree, BlockTree::make(probe.grid(), split));
  return Hierarchy(probe, options, std::move(tree), photographer).run();
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
