// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/rig.hpp"

#include "rig/bracket_taker.hpp"
#include "rig/exposure_choice.hpp"
#include "rig/lamp.hpp"
#include "symrig/base/time.hpp"
#include "symrig/hdr/merge.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

namespace symrig {

using namespace std::chrono_literals;

namespace {

/// Pictures of bit planes change while the board runs, but each run begins with a wait. A capture asks for
/// this many photographs at once.
constexpr std::size_t kPlaneBatch = 32;

/// What metering and the first photograph of the dark projector may take of a budget of seconds.
constexpr double kMeteringShare = 1.0 / 20, kBlackShare = 1.0 / 4;

/// Short frames for which there must be time in a photograph of the dark projector.
constexpr double kFewestBlackFrames = 4;

/// Takes black anew, from photographs that it is not subtracted from. After a failure it is as it was: later
/// photographs must not go without.
template <class Take>
Result<void> replace_black(std::optional<Radiance>& black, const Take& take) {
  std::optional<Radiance> before = std::exchange(black, std::nullopt);
  Result<Radiance> taken = take();
  if (!taken) {
    black = std::move(before);
    return taken.error();
  }
  black = *std::move(taken);
  return {};
}

}  // namespace

Rig::Rig(RigOptions options) : options_(std::move(options)) {}

Rig::~Rig() = default;

Result<std::unique_ptr<Rig>> Rig::open(RigDevices devices, RigOptions options) {
  std::unique_ptr<Rig> rig(new Rig(std::move(options)));
  SYMRIG_CHECK(rig->begin(std::make_unique<DeviceSet>(std::move(devices), rig->options_)));
  return rig;
}

Result<std::unique_ptr<Rig>> Rig::open(Board board, std::unique_ptr<Projector> projector,
                                       std::unique_ptr<Camera> camera, RigOptions options) {
  std::unique_ptr<Rig> rig(new Rig(std::move(options)));
  SYMRIG_CHECK(rig->begin(
      std::make_unique<DeviceSet>(std::move(board), std::move(projector), std::move(camera), rig->options_)));
  return rig;
}

Result<void> Rig::begin(std::unique_ptr<DeviceSet> devices) {
  taker_ = std::make_unique<BracketTaker>(std::move(devices), options_);
  SYMRIG_CHECK(taker_->open());
  rig::adopt_timing(options_, taker_->camera().timing());
  if (!options_.views.fits(grid()))
    return Error{
        ErrorCode::bad_argument,
        fmt::format("views {} do not tile a grid of {}", to_string(options_.views), to_string(grid())),
        "give the rows x columns of views in the picture"};
  SYMRIG_TRY(timing_, taker_->timing());
  if (shows_planes()) options_.batch = std::max(options_.batch, kPlaneBatch);
  SYMRIG_CHECK(meter());
  const RigTime metered = taker_->time();
  const std::int64_t frames = taker_->frames();
  SYMRIG_CHECK(photograph_black(first_black()));
  const double waits = taker_->time().camera + taker_->time().projector - metered.camera - metered.projector;
  if (taker_->frames() > frames)
    frame_waits_ = Nanoseconds{std::llround(1e9 * waits / static_cast<double>(taker_->frames() - frames))};
  for (std::string& warning : taker_->projector().warnings()) taker_->warn(std::move(warning));
  SYMRIG_CHECK(check_shown_planes());
  shown_ = 0;
  if (options_.reference_every > 0)
    lamp_ = std::make_unique<LampLog>(options_.reference_every, options_.lamp_drift);
  return {};
}

/// The seconds that a part of the opening may take. Without a budget of seconds, or with exposures that the
/// user has chosen, as long as it takes.
double Rig::seconds_to_open(double share) const {
  return planned() ? share * options_.most_seconds : std::numeric_limits<double>::infinity();
}

/// Bit planes are checked with light when the projector was opened, the first time and each time after. A
/// controller may come back with another table.
Result<void> Rig::check_shown_planes() {
  if (!shows_planes()) return {};
  while (planes_checked_ != trouble().projectors_reopened) {
    planes_checked_ = trouble().projectors_reopened;
    SYMRIG_CHECK(check_planes(*taker_, options_, exposures_.front()));
  }
  return {};
}

bool Rig::shows_planes() const {
  return taker_->projector().planes().planes > 0;
}

std::size_t Rig::together() const {
  return shows_planes() ? options_.batch : 1;
}

Grid Rig::grid() const {
  return taker_->projector().grid();
}

Grid Rig::camera_grid() const {
  return taker_->camera().grid();
}

int Rig::channels() const {
  return taker_->camera().channels();
}

Mosaic Rig::mosaic() const {
  return taker_->camera().mosaic();
}

ProbeCost Rig::cost() const {
  ProbeCost cost;
  cost.photographs = photographs_;
  cost.frames = taker_->frames();
  cost.rig_seconds = taker_->rig_seconds();
  cost.merge_seconds = merge_seconds_;
  return cost;
}

RigTime Rig::time() const {
  return taker_->time();
}

RigTrouble Rig::trouble() const {
  RigTrouble found = taker_->trouble();
  if (auto warning = black_warning()) found.warnings.push_back(*std::move(warning));
  return found;
}

/// Takes a wide bracket of the flood-lit scene, the shortest frame first, in a run for each. It ends with the
/// first frame that saturates: longer ones show little, and would take more time than all others of a short
/// capture. In a dark room none does; then a budget of seconds ends it.
Result<TakenBracket> Rig::metering_bracket(const Exposures& trial) {
  const Pattern flood(grid(), 1, 1.F);
  TakenBracket all;
  double left = seconds_to_open(kMeteringShare);
  for (const Nanoseconds exposure : trial) {
    left -= seconds(exposure);
    opened_short_ = left < 0;
    if (opened_short_ && !all.frames.empty()) break;
    const Exposures one{exposure};
    SYMRIG_TRY(auto taken, taker_->take({&flood, 1}, {&one, 1}));
    std::ranges::move(taken[0].frames, std::back_inserter(all.frames));
    std::ranges::copy(taken[0].exposures, std::back_inserter(all.exposures));
    // Frames without noise have no upper end, but stop where a camera's frames would.
    const auto rate = options_.reading->brightest_rate(all.frames.back(), all.exposures.back(),
                                                       taker_->camera(), options_.scale);
    if (!rate || exposure > exposure_for(*rate, 1, taker_->camera().noise())) break;
  }
  return all;
}

/// Sets the exposures from the brightest pixel of the flood-lit scene.
Result<void> Rig::meter() {
  const Camera& camera = taker_->camera();
  const Nanoseconds shortest = shortest_exposure(options_, timing_);
  const double span = std::max(1.0, 0.1 * timing_.max_exposure / shortest);
  const int count = 1 + static_cast<int>(std::log(span) / std::log(6.0));
  SYMRIG_TRY(const auto trial, plan_exposures(shortest, count, 6, timing_));
  SYMRIG_TRY(const TakenBracket taken, metering_bracket(trial));
  const auto rate = brightest_rate(*options_.reading, taken.frames, taken.exposures, camera, options_.scale);
  taker_->doubt_exposures(
      options_.reading->contradicted_exposures(taken.frames, taken.exposures, camera.noise()));
  if (!rate)
    return Error{ErrorCode::limit,
                 fmt::format("the flood-lit scene saturates the camera at its shortest exposure, {:.3g} ms",
                             1e3 * seconds(shortest)),
                 "use less light or close the aperture"};
  SYMRIG_TRY(exposures_,
             plan_exposures(exposure_for(*rate, options_.headroom, camera.noise()),
                            planned() ? kUnforeseenExposures : options_.exposures, options_.ratio, timing_));
  SYMRIG_TRY(exposures_, in_whole_periods(std::move(exposures_), options_));
  if (!planned()) return {};
  // Whole ticks of the board last as long wherever in a run they begin. Runs of planned exposures begin
  // anywhere.
  if (options_.setup.projector.light_period.count() == 0)
    for (Nanoseconds& exposure : exposures_)
      if (exposure >= shortest + 1us) exposure -= exposure % 1us;
  if (options_.reading->exact()) {
    exposures_.resize(1);  // without noise one frame is enough
    return {};
  }
  SYMRIG_TRY(const Radiance seen, merge_one(taken, 1));
  flood_lit_ = expected_flood_lit(seen);
  return {};
}

/// The exposures of the first photograph of the dark projector. If exposures are planned, better ones follow
/// where they are needed (refine_black(), and choose() if nothing is foreseen). So the longest is left out,
/// and what a budget has no seconds for.
Exposures Rig::first_black() {
  constexpr std::ptrdiff_t kEnough = 3;
  if (!planned()) return exposures_;
  Exposures bracket(exposures_.begin(), exposures_.begin() + std::min(kEnough, std::ssize(exposures_)));
  double left = seconds_to_open(kBlackShare);
  std::size_t count = 0;
  while (count < bracket.size() && (left -= seconds(bracket[count])) >= 0) ++count;
  opened_short_ = opened_short_ || count < bracket.size();
  bracket.resize(std::max<std::size_t>(1, count));
  if (count == 0) {
    const Nanoseconds longest{std::llround(1e9 * seconds_to_open(kBlackShare))};
    bracket.front() = std::max(shortest_exposure(options_, timing_), longest);
  }
  return bracket;
}

Result<void> Rig::photograph_black(const Exposures& bracket) {
  if (options_.black_photographs <= 0) return {};
  const std::size_t count = planned() ? 1 : options_.black_photographs;
  const std::vector<Pattern> dark(count, Pattern(grid()));
  const std::int64_t shown = shown_;  // dark photographs do not count for the lamp's references
  Result<void> taken = replace_black(black_, [&]() -> Result<Radiance> {
    SYMRIG_TRY(const auto photographs, photograph(dark, std::vector<Exposures>(count, bracket), nullptr));
    return average(photographs);
  });
  shown_ = shown;
  if (!taken) return taken;
  black_exposures_ = bracket.size();
  return {};
}

/// By the first photograph of the dark projector, whose frames wait as those of others do.
ExposureRules Rig::rules_with_waits() const {
  ExposureRules rules = exposure_rules(options_, taker_->camera(), timing_);
  rules.each_wait = std::max(Nanoseconds{0}, frame_waits_ - rules.each_frame);
  return rules;
}

/// Photographs black again if its error is too large for the expectation. All photographs share this error.
Result<void> Rig::refine_black(const Expectation& expected) {
  const Camera& camera = taker_->camera();
  constexpr double kNoBetter = 0.7;
  const double wanted = least_noise(expected);
  if (!black_ || black_for_ <= wanted || 16 * mean_variance(*black_) <= wanted) return {};
  // With as few seconds again, the photographs would be no better.
  if (black_seconds_ > 0 && expected.black_seconds < 2 * black_seconds_) return {};
  const ExposureRules rules = rules_with_waits();
  // In few seconds, fewer photographs leave more light to each; in fewer still, none is better than these.
  const double least = kFewestBlackFrames * seconds(rules.each_frame + rules.each_wait + rules.min_exposure);
  int count = options_.black_photographs;
  while (count > 1 && expected.black_seconds / count < least) count /= 2;
  if (expected.black_seconds < least) {
    black_seconds_ = least;
    return {};
  }
  const Expectation dark = expected_black(*black_, expected, count);
  SYMRIG_TRY(const BracketPlan plan, plan_bracket(dark, {options_.scale, 0}, camera.noise(), rules));
  // Where its light fills the wells, further photographs of it are as noisy as these.
  const double noise = plan.noise * dark.parts.front().noise / count;
  if (!plan.held_short && noise > kNoBetter * mean_variance(*black_)) {
    black_for_ = wanted;
    return {};
  }
  const std::vector<Pattern> patterns(count, Pattern(grid()));
  const std::int64_t shown = shown_;  // dark photographs do not count for the lamp's references
  Result<void> taken = replace_black(black_, [&]() -> Result<Radiance> {
    std::vector<Radiance> photographs;
    for (const Pattern& pattern : patterns) {
      SYMRIG_TRY(auto one, photograph({&pattern, 1}, {&plan.exposures, 1}, nullptr));
      photographs.push_back(std::move(one.front()));
    }
    return average(photographs);
  });
  shown_ = shown;
  if (!taken) return taken;
  black_for_ = wanted;
  black_seconds_ = plan.held_short ? expected.black_seconds : 0;
  return {};
}

/// Chooses one bracket per pattern.
Result<std::vector<Exposures>> Rig::choose(std::span<const Pattern> patterns,
                                           std::span<const Expectation> expected) {
  std::vector<Exposures> brackets(patterns.size(), exposures_);
  held_short_ = opened_short_ || black_seconds_ > 0;
  if (!planned() || options_.reading->exact()) return brackets;
  if (!expected.empty() && expected.size() != patterns.size())
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} patterns, but {} expectations", patterns.size(), expected.size())};
  // What each photograph is expected to show; nullptr: that is not known. A first look is known from
  // metering.
  std::vector<const Expectation*> expectation(patterns.size(), nullptr);
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    if (!expected.empty() && expected[i].parts.empty()) {
      flood_lit_.most_seconds = expected[i].most_seconds;
      flood_lit_.black_seconds = expected[i].black_seconds;
    }
    if (!expected.empty()) expectation[i] = expected[i].parts.empty() ? &flood_lit_ : &expected[i];
    if (expectation[i] != nullptr && expectation[i]->parts.empty()) expectation[i] = nullptr;
    if (expectation[i] != nullptr)
      SYMRIG_CHECK(refine_black(*expectation[i]));
    else if (std::isinf(black_for_) && black_exposures_ < exposures_.size())
      SYMRIG_CHECK(photograph_black(exposures_));
  }
  const LightPath path{options_.scale, black_level(black_)};
  std::vector<Result<BlackPlan>> plans(patterns.size(), Error{ErrorCode::bad_argument, "not planned"});
  tbb::parallel_for(std::size_t{0}, patterns.size(), [&](std::size_t i) {
    if (expectation[i] != nullptr) plans[i] = plan_with_black(*expectation[i], path);
  });
  for (std::size_t i = 0; i < plans.size(); ++i) {
    if (expectation[i] == nullptr) continue;
    if (!plans[i].ok()) return plans[i].error();
    held_short_ = held_short_ || black_seconds_ > 0 || plans[i]->plan.held_short;
    planned_seconds_ += plans[i]->seconds;
    seconds_without_black_ += plans[i]->seconds_without_black;
    brackets[i] = std::move(plans[i]->plan.exposures);
  }
  return brackets;
}

/// The light of the dark projector has noise, which a photograph needs time to see through. It may take as
/// long for that as a fixed bracket does, whose noise is what anybody's is who plans nothing.
Result<Rig::BlackPlan> Rig::plan_with_black(const Expectation& expected, const LightPath& path) const {
  constexpr double kNoticed = 0.003;  // black, as a share of the brightest light
  const NoiseModel& noise = taker_->camera().noise();
  const ExposureRules rules = rules_with_waits();
  const auto sum = [&rules](const Exposures& exposures) {
    double all = 0;
    for (const Nanoseconds exposure : exposures)
      all += seconds(exposure) + seconds(rules.each_frame + rules.each_wait);
    return all;
  };
  SYMRIG_TRY(BracketPlan plan, plan_bracket(expected, path, noise, rules));
  const double takes = sum(plan.exposures), brightest = brightest_light();
  if (!(path.black > kNoticed * brightest)) return BlackPlan{std::move(plan), takes, takes};
  SYMRIG_TRY(const BracketPlan without, plan_bracket(expected, {path.scale, 0}, noise, rules));
  const double fixed = sum(exposures_), needed = sum(without.exposures);
  if (takes <= fixed || needed >= fixed) return BlackPlan{std::move(plan), takes, std::min(needed, takes)};
  Expectation bounded = expected;
  bounded.most_seconds = fixed;
  SYMRIG_TRY(plan, plan_bracket(bounded, path, noise, rules));
  plan.held_short = false;  // no budget of the user
  const double bounded_to = sum(plan.exposures);
  return BlackPlan{std::move(plan), bounded_to, needed};
}

double Rig::brightest_light() const {
  double most = 0;
  for (const ExpectedPart& part : flood_lit_.parts)
    for (const ExpectedLight& light : part.lights) most = std::max(most, light.radiance);
  return most;
}

std::optional<std::string> Rig::black_warning() const {
  constexpr double kTold = 1.5;
  if (!(planned_seconds_ > kTold * seconds_without_black_)) return std::nullopt;
  return fmt::format(
      "the projector's black is {:.2g} % of white, other light in the room included: its noise makes "
      "photographs take {:.2g} times as long (darken the room, or use a projector with a darker black)",
      100 * black_level(black_) / brightest_light(), planned_seconds_ / seconds_without_black_);
}

/// The number of photographs that fit into one run.
std::size_t Rig::in_one_run(std::span<const Exposures> brackets) const {
  const std::size_t frames = options_.batch * std::max<std::size_t>(1, exposures_.size());
  std::size_t count = 0, sum = 0;
  while (count < std::min(options_.batch, brackets.size()) &&
         (count == 0 || sum + brackets[count].size() <= frames))
    sum += brackets[count++].size();
  return count;
}

Result<std::vector<Radiance>> Rig::measure_expected(std::span<const Pattern> patterns,
                                                    std::span<const Expectation> expected) {
  SYMRIG_CHECK(check_patterns(*this, patterns));
  SYMRIG_TRY(const std::vector<Exposures> brackets, choose(patterns, expected));
  std::vector<Radiance> photographs;
  photographs.reserve(patterns.size());
  while (photographs.size() < patterns.size()) {
    const std::size_t first = photographs.size();
    std::size_t count = in_one_run(std::span(brackets).subspan(first));
    if (lamp_ && lamp_->until_due(shown_) == 0) SYMRIG_CHECK(refer());
    if (lamp_) count = std::min(count, static_cast<std::size_t>(lamp_->until_due(shown_)));
    SYMRIG_TRY(auto measured, photograph(patterns.subspan(first, count),
                                         std::span(brackets).subspan(first, count), lamp_.get()));
    std::move(measured.begin(), measured.end(), std::back_inserter(photographs));
    photographs_ += static_cast<std::int64_t>(count);
  }
  return photographs;
}

/// Takes one more reference, not divided by the lamp level.
Result<void> Rig::refer() {
  const Pattern flood(grid(), 1, 1.F);
  const std::int64_t shown = shown_;
  // The flood-lit scene is bright, so the shortest exposure measures its sum as well as four exposures do.
  const Exposures bracket = planned() ? Exposures{exposures_.front()} : exposures_;
  SYMRIG_TRY(const auto reference, photograph({&flood, 1}, {&bracket, 1}, nullptr));
  if (lamp_->observe(shown, reference.front())) return {};
  return Error{ErrorCode::device_lost,
               "the lamp went out: the flood-lit scene is dark, but was bright before",
               "check the projector's lamp and shutter"};
}

Result<void> Rig::pass_over(std::int64_t photographs, const std::function<void(std::int64_t)>& passed) {
  while (photographs > 0) {
    if (lamp_ && lamp_->until_due(shown_) == 0) SYMRIG_CHECK(refer());
    const std::int64_t count = lamp_ ? std::min(photographs, lamp_->until_due(shown_)) : photographs;
    passed(count);
    taker_->forget_numbers();
    shown_ += count;
    photographs -= count;
  }
  return {};
}

LampLevel Rig::lamp() const {
  return lamp_ ? lamp_->level_at(shown_) : LampLevel{};
}

/// lamp: gives the level by which photographs are divided; nullptr: no division.
Result<std::vector<Radiance>> Rig::photograph(std::span<const Pattern> patterns,
                                              std::span<const Exposures> brackets, const LampLog* lamp) {
  SYMRIG_TRY(const auto taken, taker_->take(patterns, brackets));
  if (planes_checked_) SYMRIG_CHECK(check_shown_planes());  // the first time when the rig has been opened
  SYMRIG_TRY(auto photographs, merge_all(taken, lamp));
  shown_ += static_cast<std::int64_t>(patterns.size());
  return photographs;
}

Result<Radiance> Rig::merge_one(const TakenBracket& bracket, double lamp) const {
  return options_.reading->photograph(bracket.frames, bracket.exposures, taker_->camera(),
                                      {options_.scale, lamp, black_ ? &*black_ : nullptr});
}

Result<std::vector<Radiance>> Rig::merge_all(std::span<const TakenBracket> brackets, const LampLog* lamp) {
  const Stopwatch watch;
  std::vector<std::optional<Result<Radiance>>> merged(brackets.size());
  tbb::parallel_for(std::size_t{0}, brackets.size(), [&](std::size_t i) {
    const std::int64_t shown = shown_ + static_cast<std::int64_t>(i);
    merged[i] = merge_one(brackets[i], lamp ? lamp->level_at(shown).value : 1);
  });
  std::vector<Radiance> photographs;
  for (auto& one : merged) {
    if (!one->ok()) return one->error();
    photographs.push_back(**std::move(one));
  }
  merge_seconds_ += watch.seconds();
  return photographs;
}

}  // namespace symrig
