// SPDX-License-Identifier: Apache-2.0
#include "rig/bracket_taker.hpp"

#include "rig/shutter_timing.hpp"
#include "symrig/program/bracket.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

using Part = DeviceSet::Part;

constexpr Nanoseconds kSlice{1'000'000'000};     // between two status requests to a running board
constexpr Nanoseconds kRunSlack{5'000'000'000};  // beyond the longest possible run time
constexpr int kLockTries = 8;                    // minimum; RigOptions::retakes if that is greater

/// Index of the first frame of each photograph, and the end of the last one.
std::vector<std::size_t> first_frames(std::span<const Exposures> brackets) {
  std::vector<std::size_t> first{0};
  for (const Exposures& bracket : brackets) first.push_back(first.back() + bracket.size());
  return first;
}

Nanoseconds shortest_of(std::span<const Exposures> brackets) {
  Nanoseconds shortest = Nanoseconds::max();
  for (const Exposures& bracket : brackets)
    for (const Nanoseconds exposure : bracket) shortest = std::min(shortest, exposure);
  return shortest;
}

std::vector<std::size_t> missing_in(const std::vector<std::optional<TakenBracket>>& brackets) {
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < brackets.size(); ++i)
    if (!brackets[i]) missing.push_back(i);
  return missing;
}

Error run_failed(const Receipt& receipt) {
  const std::string cause = receipt.fault ? receipt.fault->name : std::string(name(receipt.end));
  return {ErrorCode::fault,
          fmt::format("the run failed: {}; {} late words, {} underruns, {} lost events", cause, receipt.late,
                      receipt.underruns, receipt.events_lost),
          receipt.fault ? receipt.fault->hint : "check the vsync and trigger lines"};
}

}  // namespace

BracketTaker::BracketTaker(std::unique_ptr<DeviceSet> devices, const RigOptions& options)
    : devices_(std::move(devices)), options_(options), ledgers_(options.ledger, 1) {}

Result<void> BracketTaker::open() {
  SYMRIG_CHECK(devices_->open());
  LedgerOptions ledger = options_.ledger;
  ledger.readout += std::max(Nanoseconds{0}, camera().timing().readout - options_.setup.camera.readout);
  ledgers_ = CameraLedgers(ledger, camera().count());
  return {};
}

Result<std::vector<TakenBracket>> BracketTaker::take(std::span<const Pattern> patterns,
                                                     std::span<const Exposures> exposures) {
  Brackets brackets(patterns.size());
  parts_.clear();
  for (const Exposures& bracket : exposures) parts_.emplace_back(bracket.size());
  loaded_ = false;
  std::size_t left = patterns.size();
  for (int tries = 0; left > 0;) {
    if (const auto tried = attempt(patterns, exposures, brackets); !tried)
      SYMRIG_CHECK(recover(tried.error()));
    const std::size_t still = missing_in(brackets).size();
    tries = still < left ? 0 : tries + 1;
    left = still;
    if (left > 0 && tries > options_.retakes) return give_up(tries);
  }
  std::vector<TakenBracket> taken;
  for (auto& bracket : brackets) taken.push_back(*std::move(bracket));
  return taken;
}

Result<std::vector<TakenBracket>> BracketTaker::take(std::span<const Pattern> patterns,
                                                     std::span<const Exposures> exposures,
                                                     PlaneScheduler planner) {
  planner_ = std::move(planner);
  auto taken = take(patterns, exposures);
  planner_ = plan_planes;
  return taken;
}

Result<void> BracketTaker::attempt(std::span<const Pattern> patterns, std::span<const Exposures> exposures,
                                   Brackets& brackets) {
  const std::vector<std::size_t> pending = missing_in(brackets);
  if (devices_->projector().planes().planes > 0)
    return attempt_planes(patterns, pending, exposures, brackets);
  if (devices_->projector().pacing() == Pacing::host)
    return attempt_shown(patterns, pending, exposures, brackets);
  return attempt_triggered(patterns, pending, exposures, brackets);
}

/// Takes all patterns in one run: the projector advances at each trigger.
Result<void> BracketTaker::attempt_triggered(std::span<const Pattern> patterns,
                                             std::span<const std::size_t> pending,
                                             std::span<const Exposures> exposures, Brackets& brackets) {
  SYMRIG_CHECK(lock(exposures.front().front()));
  std::vector<Pattern> again;
  std::vector<Exposures> their;
  for (const std::size_t i : pending) {
    if (pending.size() < patterns.size()) again.push_back(patterns[i]);
    their.push_back(exposures[i]);
  }
  Projector& projector = devices_->projector();
  SYMRIG_CHECK(devices_->of(Part::projector, projector.load(again.empty() ? patterns : again)));
  SYMRIG_TRY(auto taken, run(paced_setup(), their));
  for (std::size_t i = 0; i < pending.size(); ++i) keep(brackets[pending[i]], std::move(taken[i]));
  return {};
}

/// Takes one pattern after the other: each is on the screen before the board runs its bracket.
Result<void> BracketTaker::attempt_shown(std::span<const Pattern> patterns,
                                         std::span<const std::size_t> pending,
                                         std::span<const Exposures> exposures, Brackets& brackets) {
  if (!loaded_) SYMRIG_CHECK(devices_->of(Part::projector, devices_->projector().load(patterns)));
  loaded_ = true;
  for (const std::size_t i : pending) {
    SYMRIG_CHECK(lock(exposures[i].front()));
    SYMRIG_TRY(const bool shown, show(i));
    Brackets taken(1);
    if (shown) {
      SYMRIG_TRY(taken, run(paced_setup(), {&exposures[i], 1}));
    }
    keep(brackets[i], std::move(taken.front()));
  }
  return {};
}

void BracketTaker::keep(std::optional<TakenBracket>& bracket, std::optional<TakenBracket> taken) {
  trouble_.retaken += taken ? 0 : 1;
  bracket = std::move(taken);
}

/// Returns false if the screen's refresh count or clock did not advance. Then it is unknown what it shows.
Result<bool> BracketTaker::show(std::size_t index) {
  SYMRIG_TRY(const Shown shown, devices_->of(Part::projector, devices_->projector().show(index)));
  const bool goes_on = !shown_ || (shown.refresh > shown_->refresh && shown.since > shown_->since);
  shown_ = shown;
  trouble_.patterns_late += goes_on ? 0 : 1;
  return goes_on;
}

/// Takes guard frames until the ledger is locked.
Result<void> BracketTaker::lock(Nanoseconds exposure) {
  RigSetup blind = options_.setup.without(RigRole::projector).without(RigRole::vsync);
  blind.projector.sync = PatternSync::vsync;  // no line has this role: the guards wait for nothing
  const std::vector<Exposures> guards(std::max(ledgers_.guards_needed(), 1), Exposures{exposure});
  for (int tries = 0; ledgers_.needs_guards(); ++tries) {
    if (tries == std::max(kLockTries, options_.retakes)) return give_up(tries);
    SYMRIG_CHECK(run(blind, guards));
  }
  return {};
}

/// Runs the board once. Returns the brackets that are certain.
Result<BracketTaker::Brackets> BracketTaker::run(const RigSetup& setup,
                                                 std::span<const Exposures> exposures) {
  RigSetup fitted = setup;
  CameraProfile& camera = fitted.camera;
  const Nanoseconds overlap = rig::overlap_before(shortest_of(exposures), rig::longest_overlap(options_));
  camera.overlap_time_max = std::min(camera.overlap_time_max, overlap);
  const Nanoseconds gap = rig::gap_without_overlap(options_) - overlap;
  SYMRIG_TRY(const CompiledProgram compiled,
             compile_brackets(fitted, devices_->board().info(), exposures, gap));
  return run(compiled, exposures, nullptr);
}

Result<BracketTaker::Brackets> BracketTaker::run(const CompiledProgram& program,
                                                 std::span<const Exposures> exposures,
                                                 const PlaneSchedule* schedule) {
  const std::vector<std::size_t> first = first_frames(exposures);
  SYMRIG_CHECK(drain());
  SYMRIG_TRY(const Receipt receipt, run_board(program, schedule));
  rig_seconds_ += seconds(receipt.duration());
  SYMRIG_TRY(const BoardEvidence evidence,
             devices_->of(Part::board, board_evidence(receipt, exposure_line(), first, devices_->clock())));
  frames_ += static_cast<std::int64_t>(evidence.exposures.size());
  split_time(evidence, seconds(receipt.duration()));
  SYMRIG_TRY(auto frames, frames_of(evidence.exposures.size()));
  JudgedFrames judged = identify(evidence.exposures, std::move(frames));
  trouble_.unanswered += evidence.unanswered;
  trouble_.unasked += evidence.unasked;
  Brackets brackets(exposures.size());
  const bool spoiled = !receipt.clean();
  if (spoiled) {
    ++trouble_.spoiled_runs;
    ledgers_.doubt();
  }
  std::vector<bool> planes_proved(exposures.size(), true);
  if (schedule != nullptr) {
    SYMRIG_TRY(planes_proved, proved(receipt, *schedule, evidence));
  }
  const bool shown = began_after_pattern(evidence);
  trouble_.patterns_late += shown ? 0 : 1;
  if (spoiled || !shown) return brackets;
  for (std::size_t i = 0; i < exposures.size(); ++i) {
    if (!planes_proved[i]) continue;
    TakenBracket bracket;
    for (std::size_t j = first[i]; j < first[i + 1]; ++j) {
      const auto pulse = evidence.pulse_of[j];
      if (!pulse || !judged.frame[*pulse]) break;
      bracket.frames.push_back(*std::move(judged.frame[*pulse]));
      bracket.exposures.push_back(evidence.widths[*pulse]);
    }
    if (bracket.frames.size() == exposures[i].size()) brackets[i] = std::move(bracket);
  }
  last_ = judged.counts;
  last_trouble_ = std::move(judged.trouble);
  last_unanswered_ = evidence.unanswered;
  return brackets;
}

/// schedule: its pictures are shown meanwhile.
Result<Receipt> BracketTaker::run_board(const CompiledProgram& compiled, const PlaneSchedule* schedule) {
  SYMRIG_CHECK(devices_->of(Part::board, arm(compiled)));
  const Nanoseconds most = compiled.longest + kRunSlack;
  SYMRIG_TRY(Receipt receipt, schedule == nullptr ? devices_->of(Part::board, start(std::nullopt, most))
                                                  : run_with_pictures(*schedule, most));
  if (receipt.end == RunEnd::completed && !receipt.fault) return receipt;
  // A projector that no longer does what it was set to gives no edges.
  SYMRIG_CHECK(devices_->of(Part::projector, devices_->projector().check()));
  return run_failed(receipt);
}

Result<void> BracketTaker::arm(const CompiledProgram& compiled) {
  Board& board = devices_->board();
  SYMRIG_CHECK(board.upload(compiled.program));  // does nothing if the board still holds the program
  SYMRIG_CHECK(devices_->clock().ask(board));
  return board.arm();
}

/// Starts the armed board and waits for the end. at: when; none: now.
Result<Receipt> BracketTaker::start(std::optional<SteadyTime> at, Nanoseconds most) {
  Board& board = devices_->board();
  if (!at) SYMRIG_CHECK(board.start());
  if (at) SYMRIG_CHECK(start_at(*at));
  SYMRIG_TRY(auto ended, wait_for_end(most));
  SYMRIG_CHECK(devices_->clock().ask(board));
  return ended;
}

/// Checks the board from time to time: after a restart it would never end the run.
Result<Receipt> BracketTaker::wait_for_end(Nanoseconds most) {
  Board& board = devices_->board();
  for (Nanoseconds waited{0};; waited += kSlice) {
    auto receipt = board.wait(std::min(kSlice, most - waited));
    if (receipt || receipt.error().code != ErrorCode::timeout || waited + kSlice >= most) return receipt;
    SYMRIG_CHECK(devices_->clock().ask(board));
    SYMRIG_TRY(const BoardStatus status, board.status());
    const bool forgot = status.config_hash == 0;
    if (forgot)
      return Error{ErrorCode::timeout, "the board was restarted during a run", "check its power and cable"};
  }
}

/// Between two exposures, the camera is the reason for as long as it reads out.
void BracketTaker::split_time(const BoardEvidence& evidence, double run_seconds) {
  double light = 0, camera = 0;
  for (std::size_t k = 0; k < evidence.exposures.size(); ++k) {
    light += seconds(evidence.widths[k]);
    if (k == 0) continue;
    const Nanoseconds dark = evidence.exposures[k].begin - evidence.exposures[k - 1].end;
    camera += seconds(std::clamp(dark, Nanoseconds{0}, options_.setup.camera.readout));
  }
  time_.light += light;
  time_.camera += camera;
  time_.projector += run_seconds - light - camera;
}

/// Judges frames that came too late for their run.
Result<void> BracketTaker::drain() {
  SYMRIG_TRY(auto late, devices_->of(Part::camera, devices_->camera().take(0, Nanoseconds{0})));
  if (!late.empty()) identify({}, std::move(late));
  return {};
}

/// Takes one frame per exposure, and any extra frames that follow at once.
Result<std::vector<CameraFrame>> BracketTaker::frames_of(std::size_t count) {
  Camera& camera = devices_->camera();
  SYMRIG_TRY(auto frames, devices_->of(Part::camera, camera.take(count, options_.frame_patience)));
  if (frames.size() < count * camera.count()) return frames;
  SYMRIG_TRY(auto more, devices_->of(Part::camera, camera.take(1, options_.linger)));
  std::move(more.begin(), more.end(), std::back_inserter(frames));
  return frames;
}

JudgedFrames BracketTaker::identify(std::span<const SeenExposure> exposures,
                                    std::vector<CameraFrame> frames) {
  JudgedFrames judged = ledgers_.judge(exposures, std::move(frames), devices_->camera());
  trouble_.frames += judged.counts;
  return judged;
}

/// true: the screen reported the pattern before the first exposure began.
bool BracketTaker::began_after_pattern(const BoardEvidence& evidence) const {
  if (!shown_ || evidence.exposures.empty()) return true;
  const SeenExposure& first = evidence.exposures.front();
  return first.begin - first.bound >= shown_->since;
}

Result<void> BracketTaker::recover(const Error& error) {
  SYMRIG_TRY(const Part part, devices_->recover(error));
  trouble_.boards_reopened += part == Part::board;
  trouble_.cameras_reopened += part == Part::camera;
  trouble_.projectors_reopened += part == Part::projector;
  if (part == Part::camera) ledgers_.restart();
  if (part == Part::board) ledgers_.doubt();
  if (part == Part::projector) {
    loaded_ = false;
    shown_.reset();
  }
  return {};
}

Error BracketTaker::give_up(int tries) const {
  std::string trouble = last_trouble_;
  if (last_unanswered_ > 0)
    trouble +=
        fmt::format("{}{} triggers without an exposure", trouble.empty() ? "" : ", ", last_unanswered_);
  if (last_planes_) trouble += (trouble.empty() ? "" : ", ") + std::string(text_of(*last_planes_));
  if (trouble.empty()) trouble = "no problem found";
  const bool ambiguous = last_[Verdict::ambiguous] > 0;
  return {ErrorCode::frame_missing,
          fmt::format("a photograph was not certain after {} attempts; frames of the last one: {}", tries,
                      trouble),
          ambiguous      ? "each stamp fits several exposures: set a longer readout for the camera"
          : last_planes_ ? "check the lines with the roles plane and vsync, and the key latency"
                         : "check the camera's trigger and strobe lines, and its frame rate"};
}

ExposureLine BracketTaker::exposure_line() const {
  const RigSetup& setup = options_.setup;
  const bool strobed = setup.with_role(RigRole::strobe) != nullptr;
  const RigRole shows = strobed ? RigRole::strobe : RigRole::camera;
  const int line = devices_->board().info().line(setup.line_name(shows));
  const Nanoseconds delay = setup.camera.trigger_delay, none{0};
  // A strobe is late by the delay already. Marks are beside the trigger.
  if (strobed) return {line, setup.is_active_low(shows), none, none, options_.strobe_tolerance + delay};
  return {line, setup.is_active_low(shows), delay, setup.camera.exposure_offset, options_.strobe_tolerance};
}

/// With Pacing::host, the board must not trigger the projector.
RigSetup BracketTaker::paced_setup() const {
  if (devices_->projector().pacing() == Pacing::host) return options_.setup.without(RigRole::projector);
  return options_.setup;
}

}  // namespace symrig
