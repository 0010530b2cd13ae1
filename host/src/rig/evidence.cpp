// SPDX-License-Identifier: Apache-2.0
#include "rig/evidence.hpp"

#include "symrig/run/frame_ledger.hpp"

#include <algorithm>

namespace symrig {
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

}  // namespace symrig
