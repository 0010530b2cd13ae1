// SPDX-License-Identifier: Apache-2.0
#include "rig/pacing.hpp"

#include "rig/exposure_choice.hpp"
#include "symrig/program/compile.hpp"

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
                                      const std::vector<TakenBrackets>& parts) {
  std::vector<WantedExposure> wanted;
  for (const std::size_t i : pending)
    for (std::size_t j = 0; j < exposures[i].size(); ++j)
      if (!parts[i][j]) wanted.push_back({i, j, exposures[i][j]});
  return wanted;
}

/// The bracket of a photograph, if all its frames are there.
std::optional<TakenBracket> joined(TakenBrackets& parts) {
  if (std::ranges::any_of(parts, [](const auto& part) { return !part; })) return std::nullopt;
  TakenBracket whole;
  for (std::optional<TakenBracket>& part : parts) {
    whole.frames.push_back(std::move(part->frames.front()));
    whole.exposures.push_back(part->exposures.front());
  }
  return whole;
}

}  // namespace

Result<void> TriggeredPacing::attempt(const WantedPhotographs& all, std::span<const std::size_t> pending,
                                      TakenBrackets& brackets) {
  SYMRIG_CHECK(runs_.lock(all.exposures.front().front()));
  std::vector<Pattern> again;
  std::vector<Exposures> their;
  for (const std::size_t i : pending) {
    if (pending.size() < all.patterns.size()) again.push_back(all.patterns[i]);
    their.push_back(all.exposures[i]);
  }
  Projector& projector = runs_.devices().projector();
  SYMRIG_CHECK(runs_.devices().of(Part::projector, projector.load(again.empty() ? all.patterns : again)));
  SYMRIG_TRY(auto taken, runs_.run(runs_.options().setup, their));
  for (std::size_t i = 0; i < pending.size(); ++i) runs_.keep(brackets[pending[i]], std::move(taken[i]));
  return {};
}

Result<void> ShownPacing::attempt(const WantedPhotographs& all, std::span<const std::size_t> pending,
                                  TakenBrackets& brackets) {
  DeviceSet& devices = runs_.devices();
  if (!loaded_) SYMRIG_CHECK(devices.of(Part::projector, devices.projector().load(all.patterns)));
  loaded_ = true;
  const RigSetup setup = runs_.options().setup.without(RigRole::projector);  // the board must not trigger it
  for (const std::size_t i : pending) {
    SYMRIG_CHECK(runs_.lock(all.exposures[i].front()));
    SYMRIG_TRY(const Shown shown, devices.of(Part::projector, devices.projector().show(i)));
    TakenBrackets taken(1);
    if (runs_.showed(shown)) {
      SYMRIG_TRY(taken, runs_.run(setup, {&all.exposures[i], 1}));
    }
    runs_.keep(brackets[i], std::move(taken.front()));
  }
  return {};
}

void PlanePacing::begin(const WantedPhotographs& all) {
  parts_.clear();
  for (const Exposures& bracket : all.exposures) parts_.emplace_back(bracket.size());
}

Result<void> PlanePacing::attempt(const WantedPhotographs& all, std::span<const std::size_t> pending,
                                  TakenBrackets& brackets) {
  const std::vector<WantedExposure> wanted = wanted_of(pending, all.exposures, parts_);
  const std::size_t most = exposures_in_one_program();
  for (std::size_t first = 0; first < wanted.size(); first += most)
    SYMRIG_CHECK(take(all.patterns, std::span(wanted).subspan(first, std::min(most, wanted.size() - first))));
  for (const std::size_t i : pending) runs_.keep(brackets[i], joined(parts_[i]));
  return {};
}

std::size_t PlanePacing::exposures_in_one_program() const {
  const std::size_t records = runs_.devices().board().info().program_bytes / kRecordBytes;
  return std::max<std::size_t>(1, records / kMostRecords);
}

/// Takes exposures in one run of the board.
Result<void> PlanePacing::take(std::span<const Pattern> patterns, std::span<const WantedExposure> wanted) {
  SYMRIG_TRY(const PlaneSchedule schedule, schedule_(wanted, rules()));
  DeviceSet& devices = runs_.devices();
  SYMRIG_CHECK(devices.of(Part::projector, devices.projector().load_planes(patterns, schedule.pictures)));
  SYMRIG_CHECK(runs_.lock(wanted.front().time));
  std::vector<PlaneExposure> planned;
  std::vector<Exposures> brackets;
  for (const PlannedExposure& one : schedule.exposures) {
    planned.push_back(one.at);
    brackets.push_back({one.at.exposure});
  }
  SYMRIG_TRY(const CompiledProgram program,
             compile_planes(setup(), devices.board().info(), planned, runs_.options().gap));
  const RunPictures pictures{
      .show = [&](Nanoseconds longest) { return run_with_pictures(schedule, longest); },
      .prove = [&](const Receipt& receipt,
                   const BoardEvidence& evidence) { return prove(receipt, schedule, evidence); }};
  SYMRIG_TRY(auto taken, runs_.run(program, brackets, &pictures));
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
Result<Receipt> PlanePacing::run_with_pictures(const PlaneSchedule& schedule, Nanoseconds most) {
  SYMRIG_TRY(const SteadyTime begin, play_pictures(schedule));
  DeviceSet& devices = runs_.devices();
  auto receipt = devices.of(Part::board, runs_.play([&] { return start_at(begin); }, most));
  auto played = devices.projector().played();
  if (!receipt) return receipt;
  SYMRIG_TRY(played_, devices.of(Part::projector, std::move(played)));
  SYMRIG_CHECK(devices.of(Part::projector, devices.projector().check()));
  judge_pictures(schedule);
  return receipt;
}

/// Returns when the board is to start.
Result<SteadyTime> PlanePacing::play_pictures(const PlaneSchedule& schedule) {
  std::vector<std::size_t> order(static_cast<std::size_t>(lead_) - 1, schedule.order.front());
  order.insert(order.end(), schedule.order.begin(), schedule.order.end());
  SYMRIG_TRY(const Shown first, runs_.devices().of(Part::projector, runs_.devices().projector().play(order)));
  const PlaneRules known = rules();
  return first.since + (2 * (known.timing.latency + lead_ - 1) - 1) * known.refresh / 2;
}

/// A board that gets the request too late starts at once. Then no exposure of the run is in its refresh, and
/// the next run has more time.
Result<void> PlanePacing::start_at(SteadyTime at) {
  Board& board = runs_.devices().board();
  SYMRIG_TRY(const Ticks tick, runs_.devices().clock().ticks_at(at));
  auto started = board.start_at(tick);
  if (started || started.error().code != ErrorCode::device_refused) return started;
  lead_ = std::min(2 * lead_, kLongestLead);
  return board.start();
}

/// A screen that is late in a quarter of the refreshes or more gets more time for each picture.
void PlanePacing::judge_pictures(const PlaneSchedule& schedule) {
  const std::int64_t late = late_pictures(played_);
  runs_.trouble().patterns_late += late;
  if (4 * late >= static_cast<std::int64_t>(schedule.order.size())) hold_ = std::min(2 * hold_, kLongestHold);
}

PlaneRules PlanePacing::rules() const {
  const Projector& projector = runs_.devices().projector();
  const CameraProfile& camera = runs_.options().setup.camera;
  PlaneRules rules;
  rules.timing = projector.planes();
  rules.refresh = projector.refresh_period();
  rules.settle = std::max(runs_.options().setup.projector.settle, camera.trigger_delay);
  rules.gap = rig::gap_without_overlap(runs_.options());
  rules.overlap = rig::longest_overlap(runs_.options());
  rules.hold = hold_;
  // Frames without noise hold the mean light of the shutter's time, so there must be no dark time in it.
  rules.crosses = !runs_.options().reading->exact();
  const BoardInfo& board = runs_.devices().board().info();
  if (board.best_effort()) {
    rules.reaction = board.rate.nanoseconds(board.wait_latency + board.lateness);
    rules.first = rules.reaction + plane_lead(rules.timing.period) + board.rate.nanoseconds(board.min_dwell);
  }
  return rules;
}

/// The rig's lines and camera, with the planes that the projector has in fact.
RigSetup PlanePacing::setup() const {
  const PlaneTiming timing = runs_.devices().projector().planes();
  RigSetup setup = runs_.options().setup.without(RigRole::projector);
  ProjectorProfile& projector = setup.projector;
  projector.sync = PatternSync::plane;
  projector.planes = timing.planes;
  projector.plane_period = timing.period;
  projector.frame_lead = timing.frame_lead;
  projector.refresh = runs_.devices().projector().refresh_period();
  projector.vsync_timeout = std::max(projector.vsync_timeout, 3 * projector.refresh);
  setup.camera.overlap = false;  // the schedule has it already
  return setup;
}

/// Which exposures of a schedule are proved to be in their planes.
Result<RunProof> PlanePacing::prove(const Receipt& receipt, const PlaneSchedule& schedule,
                                    const BoardEvidence& evidence) const {
  const RigSetup& setup = runs_.options().setup;
  const BoardInfo& board = runs_.devices().board().info();
  const PlaneLines lines{board.line(setup.line_name(RigRole::vsync)),
                         board.line(setup.line_name(RigRole::plane)), setup.is_active_low(RigRole::vsync),
                         setup.is_active_low(RigRole::plane)};
  SYMRIG_TRY(const auto proofs,
             runs_.devices().of(Part::board, prove_planes(receipt, lines, schedule, evidence, rules(),
                                                          played_, runs_.devices().clock())));
  RunProof all;
  for (const PlaneProof proof : proofs) {
    all.proved.push_back(proof == PlaneProof::proved);
    if (proof == PlaneProof::proved || proof == PlaneProof::no_exposure) continue;
    ++all.doubtful;
    all.doubt = proof;
  }
  return all;
}

}  // namespace symrig
