// SPDX-License-Identifier: Apache-2.0

#include "rig/evidence.hpp"

#include "symrig/rig/pairs.hpp"
#include "symrig/run/frame_ledger.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

namespace symrig {

namespace {

constexpr int kBurst = 8;
constexpr Nanoseconds kKeptEvery{8'000'000'000};  // a quarter of the time span of a ClockModel
constexpr std::size_t kMostKept = 450;            // one hour; 2 KB each

Error not_read() {
  return {ErrorCode::bad_argument, "the board's clock has not been read yet", "read it first"};
}

}  // namespace

Result<void> SteadyClock::begin(Board& board) {
  model_.emplace(board.info().rate);
  past_.clear();
  opened_ = board.opened();
  for (int k = 0; k < kBurst; ++k) SYMRIG_CHECK(ask(board));
  return {};
}

Result<void> SteadyClock::ask(Board& board) {
  SYMRIG_TRY(const TimeReading reading, board.time());
  const auto added = model_->add(reading);
  if (!added)
    return Error{ErrorCode::device_lost, "the board's clock jumped: " + added.error().what,
                 "check the board's power"};
  keep(reading);
  return {};
}

void SteadyClock::keep(const TimeReading& reading) {
  if (!past_.empty() && reading.received - past_.back().received < kKeptEvery) return;
  past_.push_back({reading.taken, reading.received, *model_});
  if (past_.size() > kMostKept) past_.pop_front();
}

/// The oldest model with readings on both sides of the moment, because it reaches furthest beyond the moment.
const ClockModel& SteadyClock::model_for(BoardTime moment) const {
  const auto found = std::ranges::find_if(past_, [&](const Past& past) {
    return static_cast<std::int64_t>((past.taken - moment).count) > 0;  // the tick count wraps at 2^64
  });
  return found == past_.end() ? *model_ : found->model;
}

Result<SteadyMoment> SteadyClock::at(Ticks ticks) const {
  if (!model_) return not_read();
  const BoardTime moment{ticks};
  SYMRIG_TRY(const HostEstimate host, model_for(moment).host_at(moment));
  return SteadyMoment{opened_ + host.at.since, host.bound};
}

Result<Ticks> SteadyClock::ticks_at(SteadyTime time) const {
  if (!model_) return not_read();
  SYMRIG_TRY(const BoardEstimate board, model_->board_at(HostTime{time - opened_}));
  return board.at.since;
}

namespace {

/// With a read noise of 0.3 codes, two frames agree in one pixel with probability 3/4. They agree in all
/// required pixels by chance with probability 1e-50.
constexpr double kTellingNoise = 0.3;
constexpr std::size_t kTellingPixels = 400;

std::vector<TickPulse> pulses_of(const Receipt& receipt, const ExposureLine& line) {
  std::vector<TickPulse> pulses;
  std::optional<Ticks> begin;
  for (const CapturedEdge& edge : receipt.edges) {
    if (edge.line != line.line) continue;
    if (edge.level != line.active_low) {
      begin = edge.tick;
    } else if (begin) {
      pulses.push_back({*begin, edge.tick});
      begin.reset();
    }
  }
  return pulses;
}

Ticks later(Ticks tick, Nanoseconds time, TickRate rate) {
  return time.count() < 0 ? tick - std::min(tick, rate.ticks(-time)) : tick + rate.ticks(time);
}

std::uint64_t mixed(std::uint64_t hash, std::uint64_t word) {
  hash = (hash ^ word) * 0x9E3779B97F4A7C15U;
  return hash ^ (hash >> 29U);
}

/// 0 if too few pixels have visible noise: black or white frames look alike without being copies.
std::uint64_t content_of(std::span<const std::uint16_t> raw, const NoiseModel& noise) {
  if (noise.gain() * noise.read_noise() < kTellingNoise) return 0;
  const int saturated = noise.saturation_code();
  std::size_t telling = 0;
  std::uint64_t hash = raw.size();
  for (const std::uint16_t code : raw) {
    telling += code > 0 && code < saturated;
    hash = mixed(hash, code);
  }
  if (telling < kTellingPixels) return 0;
  return hash == 0 ? 1 : hash;
}

}  // namespace

Result<BoardEvidence> board_evidence(const Receipt& receipt, const ExposureLine& line,
                                     std::span<const std::size_t> first, const SteadyClock& clock) {
  BoardEvidence evidence;
  std::vector<FrameStamp> begins;
  for (const TickPulse& pulse : pulses_of(receipt, line)) {
    SYMRIG_TRY(const SteadyMoment begin, clock.at(pulse.begin));
    SYMRIG_TRY(const SteadyMoment end, clock.at(pulse.end));
    evidence.on_board.push_back({later(pulse.begin, line.delay, receipt.rate),
                                 later(pulse.end, line.delay + line.offset, receipt.rate)});
    evidence.exposures.push_back(
        {begin.at + line.delay, end.at + line.delay + line.offset, std::max(begin.bound, end.bound)});
    evidence.widths.push_back(receipt.rate.nanoseconds(pulse.end - pulse.begin) + line.offset);
    begins.push_back({begins.size(), pulse.begin});
  }
  SYMRIG_TRY(const auto pairs, FrameLedger::pair(receipt.marks, begins, receipt.rate.ticks(line.tolerance)));
  evidence.pulse_of.resize(first.back());
  for (const LedgerEntry& entry : pairs.entries()) {
    if (entry.photograph + 1 >= first.size()) continue;
    const std::size_t at = first[entry.photograph] + entry.exposure;
    if (at < first[entry.photograph + 1]) evidence.pulse_of[at] = entry.frame;
  }
  evidence.unanswered = std::count(evidence.pulse_of.begin(), evidence.pulse_of.end(), std::nullopt);
  evidence.unasked = static_cast<std::int64_t>(pairs.unasked().size());
  return evidence;
}

SeenFrame camera_evidence(const CameraFrame& frame, const NoiseModel& noise) {
  return {frame.sequence, frame.stamp, frame.stamp_of, frame.damaged, content_of(frame.raw, noise)};
}

namespace {

/// The places of the frames of one camera.
std::vector<std::size_t> places_of(std::size_t camera, std::span<const CameraFrame> frames) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (frames[i].camera == camera) places.push_back(i);
  return places;
}

std::string trouble_of(const FrameCounts& counts, std::size_t camera, std::size_t cameras) {
  std::string trouble = counts.trouble();
  if (trouble.empty() || cameras == 1) return trouble;
  return fmt::format("pair {}: {}", camera + 1, trouble);
}

}  // namespace

JudgedFrames CameraLedgers::judge(std::span<const SeenExposure> exposures, std::vector<CameraFrame> frames,
                                  const Camera& camera) {
  JudgedFrames judged;
  std::vector<std::vector<CameraFrame>> parts(exposures.size());
  for (std::size_t k = 0; k < ledgers_.size(); ++k) {
    const std::vector<std::size_t> places = places_of(k, frames);
    std::vector<SeenFrame> seen;
    seen.reserve(places.size());
    for (const std::size_t i : places) seen.push_back(camera_evidence(frames[i], camera.part(k).noise()));
    const RunIdentity identity = ledgers_[k].judge(exposures, seen);
    judged.counts += identity.counts;
    const std::string trouble = trouble_of(identity.counts, k, ledgers_.size());
    judged.trouble += (judged.trouble.empty() || trouble.empty() ? "" : ", ") + trouble;
    for (std::size_t j = 0; j < exposures.size(); ++j)
      if (identity.frame[j]) parts[j].push_back(std::move(frames[places[*identity.frame[j]]]));
  }
  judged.frame.resize(exposures.size());
  for (std::size_t j = 0; j < exposures.size(); ++j)
    if (parts[j].size() == ledgers_.size())
      judged.frame[j] = ledgers_.size() == 1 ? std::move(parts[j].front()) : join_frames(std::move(parts[j]));
  return judged;
}

void CameraLedgers::restart() {
  for (CameraLedger& ledger : ledgers_) ledger.restart();
}

void CameraLedgers::doubt() {
  for (CameraLedger& ledger : ledgers_) ledger.doubt();
}

bool CameraLedgers::needs_guards() const {
  return std::ranges::any_of(ledgers_, [](const CameraLedger& ledger) { return ledger.needs_guards(); });
}

int CameraLedgers::guards_needed() const {
  int most = 0;
  for (const CameraLedger& ledger : ledgers_) most = std::max(most, ledger.guards_needed());
  return most;
}

}  // namespace symrig
