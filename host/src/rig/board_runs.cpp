// SPDX-License-Identifier: Apache-2.0
#include "rig/board_runs.hpp"

#include "rig/exposure_choice.hpp"
#include "symrig/program/compile.hpp"

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

Error run_failed(const Receipt& receipt) {
  const std::string cause = receipt.fault ? receipt.fault->name : std::string(name(receipt.end));
  return {ErrorCode::fault,
          fmt::format("the run failed: {}; {} late words, {} underruns, {} lost events", cause, receipt.late,
                      receipt.underruns, receipt.events_lost),
          receipt.fault ? receipt.fault->hint : "check the vsync and trigger lines"};
}

}  // namespace

BoardRuns::BoardRuns(std::unique_ptr<DeviceSet> devices, const RigOptions& options)
    : devices_(std::move(devices)), options_(options), ledgers_(options.ledger, 1) {}

Result<void> BoardRuns::open() {
  SYMRIG_CHECK(devices_->open());
  LedgerOptions ledger = options_.ledger;
  ledger.readout +=
      std::max(Nanoseconds{0}, devices_->camera().timing().readout - options_.setup.camera.readout);
  ledgers_ = CameraLedgers(ledger, devices_->camera().count());
  return {};
}

void BoardRuns::keep(std::optional<TakenBracket>& bracket, std::optional<TakenBracket> taken) {
  trouble_.retaken += taken ? 0 : 1;
  bracket = std::move(taken);
}

bool BoardRuns::showed(const Shown& shown) {
  const bool goes_on = !shown_ || (shown.refresh > shown_->refresh && shown.since > shown_->since);
  shown_ = shown;
  trouble_.patterns_late += goes_on ? 0 : 1;
  return goes_on;
}

Result<void> BoardRuns::lock(Nanoseconds exposure) {
  RigSetup blind = options_.setup.without(RigRole::projector).without(RigRole::vsync);
  blind.projector.sync = PatternSync::vsync;  // no line has this role: the guards wait for nothing
  const std::vector<Exposures> guards(std::max(ledgers_.guards_needed(), 1), Exposures{exposure});
  for (int tries = 0; ledgers_.needs_guards(); ++tries) {
    if (tries == std::max(kLockTries, options_.retakes)) return give_up(tries);
    SYMRIG_CHECK(run(blind, guards));
  }
  return {};
}

Result<TakenBrackets> BoardRuns::run(const RigSetup& setup, std::span<const Exposures> exposures) {
  RigSetup fitted = setup;
  CameraProfile& camera = fitted.camera;
  const Nanoseconds overlap = rig::overlap_before(shortest_of(exposures), rig::longest_overlap(options_));
  camera.overlap_time_max = std::min(camera.overlap_time_max, overlap);
  const Nanoseconds gap = rig::gap_without_overlap(options_) - overlap;
  SYMRIG_TRY(const CompiledProgram compiled,
             compile_brackets(fitted, devices_->board().info(), exposures, gap));
  return run(compiled, exposures, nullptr);
}

Result<TakenBrackets> BoardRuns::run(const CompiledProgram& program, std::span<const Exposures> exposures,
                                     const RunPictures* pictures) {
  const std::vector<std::size_t> first = first_frames(exposures);
  SYMRIG_CHECK(drain());
  SYMRIG_TRY(const Receipt receipt, run_board(program, pictures));
  rig_seconds_ += seconds(receipt.duration());
  SYMRIG_TRY(const BoardEvidence evidence,
             devices_->of(Part::board, board_evidence(receipt, exposure_line(), first, devices_->clock())));
  frames_ += static_cast<std::int64_t>(evidence.exposures.size());
  split_time(evidence, seconds(receipt.duration()));
  SYMRIG_TRY(auto frames, frames_of(evidence.exposures.size()));
  JudgedFrames judged = identify(evidence.exposures, std::move(frames));
  trouble_.unanswered += evidence.unanswered;
  trouble_.unasked += evidence.unasked;
  TakenBrackets brackets(exposures.size());
  const bool spoiled = !receipt.clean();
  if (spoiled) {
    ++trouble_.spoiled_runs;
    ledgers_.doubt();
  }
  std::vector<bool> planes_proved(exposures.size(), true);
  if (pictures != nullptr) {
    SYMRIG_TRY(RunProof proof, pictures->prove(receipt, evidence));
    planes_proved = std::move(proof.proved);
    trouble_.planes_doubtful += proof.doubtful;
    last_planes_ = proof.doubt;
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

Result<Receipt> BoardRuns::run_board(const CompiledProgram& compiled, const RunPictures* pictures) {
  SYMRIG_CHECK(devices_->of(Part::board, arm(compiled)));
  const Nanoseconds most = compiled.longest + kRunSlack;
  SYMRIG_TRY(Receipt receipt,
             pictures != nullptr
                 ? pictures->show(most)
                 : devices_->of(Part::board, play([&] { return devices_->board().start(); }, most)));
  if (receipt.end == RunEnd::completed && !receipt.fault) return receipt;
  // A projector that no longer does what it was set to gives no edges.
  SYMRIG_CHECK(devices_->of(Part::projector, devices_->projector().check()));
  return run_failed(receipt);
}

Result<void> BoardRuns::arm(const CompiledProgram& compiled) {
  Board& board = devices_->board();
  SYMRIG_CHECK(board.upload(compiled.program));  // does nothing if the board still holds the program
  SYMRIG_CHECK(devices_->clock().ask(board));
  return board.arm();
}

Result<Receipt> BoardRuns::play(const std::function<Result<void>()>& begin, Nanoseconds most) {
  SYMRIG_CHECK(begin());
  SYMRIG_TRY(auto ended, wait_for_end(most));
  SYMRIG_CHECK(devices_->clock().ask(devices_->board()));
  return ended;
}

/// Checks the board from time to time: after a restart it would never end the run.
Result<Receipt> BoardRuns::wait_for_end(Nanoseconds most) {
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
void BoardRuns::split_time(const BoardEvidence& evidence, double run_seconds) {
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
Result<void> BoardRuns::drain() {
  SYMRIG_TRY(auto late, devices_->of(Part::camera, devices_->camera().take(0, Nanoseconds{0})));
  if (!late.empty()) identify({}, std::move(late));
  return {};
}

/// Takes one frame per exposure, and any extra frames that follow at once.
Result<std::vector<CameraFrame>> BoardRuns::frames_of(std::size_t count) {
  Camera& camera = devices_->camera();
  SYMRIG_TRY(auto frames, devices_->of(Part::camera, camera.take(count, options_.frame_patience)));
  if (frames.size() < count * camera.count()) return frames;
  SYMRIG_TRY(auto more, devices_->of(Part::camera, camera.take(1, options_.linger)));
  std::move(more.begin(), more.end(), std::back_inserter(frames));
  return frames;
}

JudgedFrames BoardRuns::identify(std::span<const SeenExposure> exposures, std::vector<CameraFrame> frames) {
  JudgedFrames judged = ledgers_.judge(exposures, std::move(frames), devices_->camera());
  trouble_.frames += judged.counts;
  return judged;
}

/// true: the screen reported the pattern before the first exposure began.
bool BoardRuns::began_after_pattern(const BoardEvidence& evidence) const {
  if (!shown_ || evidence.exposures.empty()) return true;
  const SeenExposure& first = evidence.exposures.front();
  return first.begin - first.bound >= shown_->since;
}

Result<DeviceSet::Part> BoardRuns::recover(const Error& error) {
  SYMRIG_TRY(const Part part, devices_->recover(error));
  trouble_.boards_reopened += part == Part::board;
  trouble_.cameras_reopened += part == Part::camera;
  trouble_.projectors_reopened += part == Part::projector;
  if (part == Part::camera) ledgers_.restart();
  if (part == Part::board) ledgers_.doubt();
  if (part == Part::projector) shown_.reset();
  return part;
}

Error BoardRuns::give_up(int tries) const {
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

ExposureLine BoardRuns::exposure_line() const {
  const RigSetup& setup = options_.setup;
  const bool strobed = setup.with_role(RigRole::strobe) != nullptr;
  const RigRole shows = strobed ? RigRole::strobe : RigRole::camera;
  const int line = devices_->board().info().line(setup.line_name(shows));
  const Nanoseconds delay = setup.camera.trigger_delay, none{0};
  // A strobe is late by the delay already. Marks are beside the trigger.
  if (strobed) return {line, setup.is_active_low(shows), none, none, options_.strobe_tolerance + delay};
  return {line, setup.is_active_low(shows), delay, setup.camera.exposure_offset, options_.strobe_tolerance};
}

}  // namespace symrig
