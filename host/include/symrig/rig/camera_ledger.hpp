// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/units.hpp"
#include "symrig/board/clock_time.hpp"
#include "symrig/camera/camera.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// An exposure that the camera made, as the board saw it: a pulse of its strobe line, or of its trigger line
/// if it has none.
struct SeenExposure {
  SteadyTime begin, end;  ///< the board's stamps on the host's clock
  Nanoseconds bound{0};   ///< |begin - truth|, |end - truth| at most
};

/// A frame as the camera tells of it.
struct SeenFrame {
  std::uint64_t sequence = 0;
  SteadyTime stamp;
  StampOf stamp_of = StampOf::nothing;
  bool damaged = false;
  /// A hash of its pixels: two frames of one content are one frame handed over twice. 0: nothing can be told
  /// by the content (all black or all saturated, or a camera without noise).
  std::uint64_t content = 0;
};

/// What the ledger makes of a frame.
enum class Verdict : std::uint8_t {
  certain,  ///< sequence, stamp and content agree on its exposure, and no other frame claims it
  guard,    ///< taken while the ledger was not locked: agrees with its neighbours, but nobody trusts it yet
  damaged,  ///< the driver says that it is not whole
  duplicated,  ///< the same sequence number, exposure or content as another frame
  late,        ///< its stamp is that of a later exposure than its number, or it came after its run
  swapped,     ///< its stamp is that of an earlier exposure than its number
  extra,       ///< its stamp fits no exposure
  ambiguous,   ///< its stamp fits several exposures: the clocks are known too badly
  doubtful     ///< beside a contradiction
};
std::string_view name(Verdict verdict);

/// Frames counted by what became of them.
struct FrameCounts {
  static constexpr std::size_t kVerdicts = 9;
  std::array<std::int64_t, kVerdicts> by_verdict{};
  std::int64_t missing = 0;  ///< exposures without a frame

  std::int64_t operator[](Verdict verdict) const { return by_verdict[static_cast<std::size_t>(verdict)]; }
  FrameCounts& operator+=(const FrameCounts& other);
  /// "1 missing, 2 late"; empty if all were certain or guards.
  std::string trouble() const;
};

/// What became of one run.
struct RunIdentity {
  std::vector<Verdict> frames;                    ///< of each frame given
  std::vector<std::optional<std::size_t>> frame;  ///< of each exposure: the frame that certainly shows it
  FrameCounts counts;
};

struct LedgerOptions {
  /// Frames in a row that must agree after a stream start before any is trusted; 0 = the first one is.
  int guards = 4;
  /// A stamp may lie that far from the exposure's begin or end, besides what the clocks leave open.
  Nanoseconds tolerance{200'000};
  /// StampOf::exposure_end: a stamp may come as late as this after the end of the exposure.
  Nanoseconds readout{3'000'000};
};

/// Which frame shows which exposure (docs/ledger.md). Two witnesses that know nothing of each other name the
/// exposure of each frame: its sequence number, counted from where the ledger was locked, and its stamp,
/// compared with the board's stamps of the exposures. A third one, the content, tells copies. A frame is
/// certain only while the witnesses have agreed without a contradiction since the ledger was locked, and if
/// no other frame claims its exposure by any of them. Counting frames is no witness: a loss and a copy cancel
/// in a count, and in nothing else.
///
/// A contradiction unlocks the ledger; as many frames in a row as there are guards (three at least) lock it
/// again where they agree. A camera without stamps: see docs/ledger.md.
class CameraLedger {
 public:
  explicit CameraLedger(const LedgerOptions& options = {}) : options_(options) {}

  /// All exposures of a run in order of time, and all frames that came since the last call in order of
  /// arrival. exposures may be empty: frames left over.
  RunIdentity judge(std::span<const SeenExposure> exposures, std::span<const SeenFrame> frames);

  /// The camera streams anew: its numbers begin again.
  void restart();
  /// The board lost count of the exposures.
  void doubt();
  bool locked() const { return offset_.has_value(); }
  /// Frames that nobody trusts have to be taken before photographs.
  bool needs_guards() const { return !locked() && guards_needed() > 0; }
  /// As many in a row.
  int guards_needed() const;
  const LedgerOptions& options() const { return options_; }

 private:
  class Run;
  void unlock();
  /// Takes note of a frame that two witnesses put at `exposure`; true if the ledger is locked now.
  bool agree(std::int64_t offset);
  bool is_copy(std::uint64_t content) const;
  void remember(std::span<const SeenExposure> exposures);

  LedgerOptions options_;
  std::int64_t first_ = 0;                 // number of the run's first exposure, since the stream began
  std::optional<std::int64_t> offset_;     // sequence number of exposure 0
  std::optional<std::int64_t> candidate_;  // the same, not yet trusted
  int agreed_ = 0;                         // frames in a row that agree with the candidate
  bool contradicted_ = false;              // since the stream began
  bool stamped_ = false;                   // some frame since the stream began had a stamp
  bool ended_with_gap_ = false;            // the last exposure of the run before has no frame
  std::deque<SeenExposure> past_;          // the exposures before first_, the newest last
  std::deque<std::uint64_t> contents_;     // of the newest frames
};

}  // namespace symrig
