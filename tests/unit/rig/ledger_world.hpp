// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/statistics.hpp"
#include "symrig/rig/camera_ledger.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

namespace symrig::test {

/// How often a camera and its driver misbehave: probabilities a frame.
struct CameraFaults {
  double lost = 0;            ///< never arrives; its number is missing in the sequence
  double lost_unnoticed = 0;  ///< never arrives, and nobody counted it
  double same_again = 0;      ///< the same buffer twice: number, stamp and content
  double renumbered = 0;      ///< twice, the second time with a number of its own
  double restamped = 0;       ///< twice, with a number and a stamp of its own, a period later
  double late_stamp = 0;      ///< the stamp is a period late
  double late_arrival = 0;    ///< comes after the frame behind it, or with the next run
  double damaged = 0;
  double jitter = 0;    ///< of every stamp, uniform, +/- [s]
  bool content = true;  ///< frames differ by their noise
};

/// A frame with the exposure that it really shows, which the ledger never gets to see.
struct TrueFrame {
  SeenFrame seen;
  std::int64_t truth = 0;
};

/// A board and a camera that make runs of exposures, and a driver that hands frames over with faults. Time
/// begins nowhere special: the camera's first number and the clock's first reading are random.
class LedgerWorld {
 public:
  LedgerWorld(std::uint64_t seed, const CameraFaults& faults, StampOf stamp_of, bool equal_exposures)
      : random_(seed), faults_(faults), stamp_of_(stamp_of), equal_(equal_exposures) {
    number_ = random_.bits() % 1000;
    now_ = Nanoseconds(static_cast<std::int64_t>(random_.bits() % 1'000'000'000'000U));
  }

  struct Run {
    std::vector<SeenExposure> exposures;
    std::vector<TrueFrame> frames;
    std::int64_t first = 0;  ///< true number of the first exposure
  };

  /// frames: exposures of the run; each bracket of `per` is geometric, or all are equal.
  Run run(std::size_t exposures, std::size_t per) {
    Run out;
    out.first = truth_;
    out.frames = std::move(held_);
    held_.clear();
    for (std::size_t i = 0; i < exposures; ++i) expose(out, i % per);
    now_ += Nanoseconds{30'000'000};
    return out;
  }

 private:
  static constexpr Nanoseconds kGap{4'000'000};

  void expose(Run& out, std::size_t k) {
    const Nanoseconds length{equal_ ? 10'000'000 : 2'000'000 << (2 * k)};
    SeenExposure exposure{{now_}, {now_ + length}, Nanoseconds{50'000}};
    out.exposures.push_back(off_by_the_clock(exposure));
    TrueFrame frame;
    frame.truth = truth_++;
    frame.seen.stamp_of = stamp_of_;
    frame.seen.stamp = stamp_of_ == StampOf::exposure_begin ? exposure.begin : exposure.end;
    frame.seen.content = faults_.content ? random_.bits() | 1U : 0;
    const Nanoseconds period = length + kGap;
    now_ += period;
    deliver(out, frame, period);
  }

  /// The board's stamps as the host knows them: off by at most what the clock model says.
  SeenExposure off_by_the_clock(SeenExposure exposure) {
    const Nanoseconds off{static_cast<std::int64_t>((2 * random_.uniform() - 1) * 50'000)};
    exposure.begin = exposure.begin + off;
    exposure.end = exposure.end + off;
    return exposure;
  }

  bool happens(double probability) { return random_.uniform() < probability; }

  void deliver(Run& out, TrueFrame frame, Nanoseconds period) {
    if (happens(faults_.lost_unnoticed)) return;
    frame.seen.sequence = number_++;
    if (happens(faults_.lost)) return;
    stamp(frame, period);
    frame.seen.damaged = happens(faults_.damaged);
    const bool late = happens(faults_.late_arrival);
    if (!late) out.frames.push_back(frame);
    release(out);
    if (late) held_.push_back(frame);
    copy(out, frame, period);
  }

  void stamp(TrueFrame& frame, Nanoseconds period) {
    if (happens(faults_.late_stamp)) frame.seen.stamp = frame.seen.stamp + period;
    const double jitter = 1e9 * faults_.jitter * (2 * random_.uniform() - 1);
    frame.seen.stamp = frame.seen.stamp + Nanoseconds(static_cast<std::int64_t>(jitter));
  }

  /// Frames that were late arrive now.
  void release(Run& out) {
    if (held_.empty() || random_.uniform() < 0.3) return;
    out.frames.insert(out.frames.end(), held_.begin(), held_.end());
    held_.clear();
  }

  void copy(Run& out, TrueFrame frame, Nanoseconds period) {
    if (happens(faults_.same_again)) out.frames.push_back(frame);
    const bool restamped = happens(faults_.restamped);
    if (!restamped && !happens(faults_.renumbered)) return;
    frame.seen.sequence = number_++;
    if (restamped) frame.seen.stamp = frame.seen.stamp + period;
    stamp(frame, period);
    out.frames.push_back(frame);
  }

  Random random_;
  CameraFaults faults_;
  StampOf stamp_of_;
  bool equal_;
  std::uint64_t number_ = 0;
  std::int64_t truth_ = 0;
  Nanoseconds now_{0};
  std::vector<TrueFrame> held_;
};

/// What became of a campaign.
struct Campaign {
  std::int64_t frames = 0;       ///< exposures made
  std::int64_t photographs = 0;  ///< asked for, retakes included
  std::int64_t taken = 0;        ///< believed
  std::int64_t wrong = 0;        ///< believed, with a frame of another exposure or a damaged one
  std::int64_t refused = 0;      ///< not believed, though each of its frames was there, whole and untampered
  FrameCounts counts;
};

/// Runs of `batch` photographs of `per` exposures until as many exposures have been made; guard runs where
/// the ledger asks for them, as the rig does.
inline Campaign campaign(LedgerWorld& world, CameraLedger& ledger, std::int64_t exposures, std::size_t batch,
                         std::size_t per) {
  Campaign out;
  const auto judge = [&](const LedgerWorld::Run& run) {
    std::vector<SeenFrame> seen;
    for (const TrueFrame& frame : run.frames) seen.push_back(frame.seen);
    out.frames += static_cast<std::int64_t>(run.exposures.size());
    RunIdentity identity = ledger.judge(run.exposures, seen);
    out.counts += identity.counts;
    return identity;
  };
  while (out.frames < exposures) {
    while (ledger.needs_guards() && out.frames < exposures)
      judge(world.run(static_cast<std::size_t>(ledger.guards_needed()), 1));
    const LedgerWorld::Run run = world.run(batch * per, per);
    const RunIdentity identity = judge(run);
    for (std::size_t i = 0; i < batch; ++i) {
      ++out.photographs;
      bool believed = true, wrong = false;
      for (std::size_t j = i * per; j < (i + 1) * per; ++j) {
        believed = believed && identity.frame[j].has_value();
        if (!identity.frame[j]) continue;
        const TrueFrame& frame = run.frames[*identity.frame[j]];
        wrong = wrong || frame.truth != run.first + static_cast<std::int64_t>(j) || frame.seen.damaged;
      }
      out.taken += believed;
      out.wrong += believed && wrong;
    }
  }
  return out;
}

}  // namespace symrig::test
