// SPDX-License-Identifier: Apache-2.0
// Brackets in the bit planes of pictures that change while the board runs.
#include "rig/bracket_taker.hpp"
#include "rig/shutter_timing.hpp"
#include "symrig/program/bracket.hpp"

#include <algorithm>
#include <utility>

namespace symrig {
namespace {

using Part = DeviceSet::Part;

constexpr std::size_t kRecordBytes = 8;
constexpr std::size_t kMostRecords = 12;  // of an exposure in a program: marks, holds, a wait, a pulse
constexpr int kLongestHold = 8, kLongestLead = 16;  // refreshes

/// The exposures of `pending` photographs that have no frame yet.
std::vector<WantedExposure> wanted_of(std::span<const std::size_t> pending,
                                      std::span<const Exposures> exposures,
                                      const std::vector<std::vector<std::optional<TakenBracket>>>& parts) {
  std::vector<WantedExposure> wanted;
  for (const std::size_t i : pending)
    for (std::size_t j = 0; j < exposures[i].size(); ++j)
      if (!parts[i][j]) wanted.push_back({i, j, exposures[i][j]});
  return wanted;
}

/// The bracket of a photograph, if all its frames are there.
std::optional<TakenBracket> joined(std::vector<std::optional<TakenBracket>>& parts) {
  if (std::ranges::any_of(parts, [](const auto& part) { return !part; })) return std::nullopt;
  TakenBracket whole;
  for (std::optional<TakenBracket>& part : parts) {
    whole.frames.push_back(std::move(part->frames.front()));
    whole.exposures.push_back(part->exposures.front());
  }
  return whole;
}

}  // namespace

/// Takes all exposures in bit planes, as many in a run as the board's memory holds. A frame that is certain
/// stays: only the others are taken again.
Result<void> BracketTaker::attempt_planes(std::span<const Pattern> patterns,
                                          std::span<const std::size_t> pending,
                                          std::span<const Exposures> exposures, Brackets& brackets) {
  const std::vector<WantedExposure> wanted = wanted_of(pending, exposures, parts_);
  const std::size_t most = exposures_in_one_program();
  for (std::size_t first = 0; first < wanted.size(); first += most)
    SYMRIG_CHECK(
        take_planes(patterns, std::span(wanted).subspan(first, std::min(most, wanted.size() - first))));
  for (const std::size_t i : pending) keep(brackets[i], joined(parts_[i]));
  return {};
}

std::size_t BracketTaker::exposures_in_one_program() const {
  const std::size_t records = devices_->board().info().program_bytes / kRecordBytes;
  return std::max<std::size_t>(1, records / kMostRecords);
}

/// Takes exposures in one run of the board.
Result<void> BracketTaker::take_planes(std::span<const Pattern> patterns,
                                       std::span<const WantedExposure> wanted) {
  SYMRIG_TRY(const PlaneSchedule schedule, planner_(wanted, plane_rules()));
  SYMRIG_CHECK(devices_->of(Part::projector, devices_->projector().load_planes(patterns, schedule.pictures)));
  SYMRIG_CHECK(lock(wanted.front().time));
  std::vector<PlaneExposure> planned;
  std::vector<Exposures> brackets;
  for (const PlannedExposure& one : schedule.exposures) {
    planned.push_back(one.at);
    brackets.push_back({one.at.exposure});
  }
  SYMRIG_TRY(const CompiledProgram program,
             compile_planes(plane_setup(), devices_->board().info(), planned, options_.gap));
  SYMRIG_TRY(auto taken, run(program, brackets, &schedule));
  for (std::size_t k = 0; k < taken.size(); ++k) {
    const auto& [what, at] = schedule.exposures[k];
    if (!taken[k]) continue;
    taken[k]->exposures.front() += what.time - at.exposure;  // less the dark time between refreshes
    parts_[what.photograph][what.exposure] = std::move(taken[k]);
  }
  return {};
}

/// The board and the screen run side by side. The board starts half a refresh before the planes of the first
/// picture begin, so that it takes their frame edge as the first one.
Result<Receipt> BracketTaker::run_with_pictures(const PlaneSchedule& schedule, Nanoseconds most) {
  SYMRIG_TRY(const SteadyTime begin, play_pictures(schedule));
  auto receipt = devices_->of(Part::board, start(begin, most));
  auto played = devices_->projector().played();
  if (!receipt) return receipt;
  SYMRIG_TRY(played_, devices_->of(Part::projector, std::move(played)));
  SYMRIG_CHECK(devices_->of(Part::projector, devices_->projector().check()));
  judge_pictures(schedule);
  return receipt;
}

/// Returns when the board is to start.
Result<SteadyTime> BracketTaker::play_pictures(const PlaneSchedule& schedule) {
  std::vector<std::size_t> order(static_cast<std::size_t>(lead_) - 1, schedule.order.front());
  order.insert(order.end(), schedule.order.begin(), schedule.order.end());
  SYMRIG_TRY(const Shown first, devices_->of(Part::projector, devices_->projector().play(order)));
  const PlaneRules rules = plane_rules();
  return first.since + (2 * (rules.timing.latency + lead_ - 1) - 1) * rules.refresh / 2;
}

/// A board that gets the request too late starts at once. Then no exposure of the run is in its refresh, and
/// the next run has more time.
Result<void> BracketTaker::start_at(SteadyTime at) {
  Board& board = devices_->board();
  SYMRIG_TRY(const Ticks tick, devices_->clock().ticks_at(at));
  auto started = board.start_at(tick);
  if (started || started.error().code != ErrorCode::device_refused) return started;
  lead_ = std::min(2 * lead_, kLongestLead);
  return board.start();
}

/// A screen that is late in a quarter of the refreshes or more gets more time for each picture.
void BracketTaker::judge_pictures(const PlaneSchedule& schedule) {
  const std::int64_t late = late_pictures(played_);
  trouble_.patterns_late += late;
  if (4 * late >= static_cast<std::int64_t>(schedule.order.size())) hold_ = std::min(2 * hold_, kLongestHold);
}

PlaneRules BracketTaker::plane_rules() const {
  const Projector& projector = devices_->projector();
  const CameraProfile& camera = options_.setup.camera;
  PlaneRules rules;
  rules.timing = projector.planes();
  rules.refresh = projector.refresh_period();
  rules.settle = std::max(options_.setup.projector.settle, camera.trigger_delay);
  rules.gap = rig::gap_without_overlap(options_);
  rules.overlap = rig::longest_overlap(options_);
  rules.hold = hold_;
  // Frames without noise hold the mean light of the shutter's time, so there must be no dark time in it.
  rules.crosses = !options_.reading->exact();
  const BoardInfo& board = devices_->board().info();
  if (board.best_effort()) {
    rules.reaction = board.rate.nanoseconds(board.wait_latency + board.lateness);
    rules.first = rules.reaction + plane_lead(rules.timing.period) + board.rate.nanoseconds(board.min_dwell);
  }
  return rules;
}

/// The rig's lines and camera, with the planes that the projector has in fact.
RigSetup BracketTaker::plane_setup() const {
  const PlaneTiming timing = devices_->projector().planes();
  RigSetup setup = options_.setup.without(RigRole::projector);
  ProjectorProfile& projector = setup.projector;
  projector.sync = PatternSync::plane;
  projector.planes = timing.planes;
  projector.plane_period = timing.period;
  projector.frame_lead = timing.frame_lead;
  projector.refresh = devices_->projector().refresh_period();
  projector.vsync_timeout = std::max(projector.vsync_timeout, 3 * projector.refresh);
  setup.camera.overlap = false;  // the schedule has it already
  return setup;
}

Result<CameraTiming> BracketTaker::timing() const {
  CameraTiming timing = devices_->camera().timing();
  if (devices_->projector().planes().planes == 0) return timing;
  const PlaneRules rules = plane_rules();
  SYMRIG_TRY(const Nanoseconds longest, longest_in_planes(rules));
  if (!rules.may_cross()) timing.max_exposure = std::min(timing.max_exposure, longest);
  return timing;
}

/// Which exposures of a schedule are proved to be in their planes.
Result<std::vector<bool>> BracketTaker::proved(const Receipt& receipt, const PlaneSchedule& schedule,
                                               const BoardEvidence& evidence) {
  const RigSetup& setup = options_.setup;
  const BoardInfo& board = devices_->board().info();
  const PlaneLines lines{board.line(setup.line_name(RigRole::vsync)),
                         board.line(setup.line_name(RigRole::plane)), setup.is_active_low(RigRole::vsync),
                         setup.is_active_low(RigRole::plane)};
  SYMRIG_TRY(const auto proofs,
             devices_->of(Part::board, prove_planes(receipt, lines, schedule, evidence, plane_rules(),
                                                    played_, devices_->clock())));
  std::vector<bool> all;
  last_planes_.reset();
  for (const PlaneProof proof : proofs) {
    all.push_back(proof == PlaneProof::proved);
    if (proof == PlaneProof::proved || proof == PlaneProof::no_exposure) continue;
    ++trouble_.planes_doubtful;
    last_planes_ = proof;
  }
  return all;
}

}  // namespace symrig
