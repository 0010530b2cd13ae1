// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/time.hpp"
#include "symrig/board/clock_model.hpp"
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

/// An exposure that the camera made, as the board saw it: a pulse of the strobe line. Without a strobe line:
/// a pulse of the trigger line.
struct SeenExposure {
  SteadyTime begin, end;  ///< the board's stamps, converted to the host's clock
  Nanoseconds bound{0};   ///< greatest error of begin and end
};

/// A frame as the camera reports it.
struct SeenFrame {
  std::uint64_t sequence = 0;
  SteadyTime stamp;
  StampOf stamp_of = StampOf::nothing;
  bool damaged = false;
  /// Hash of the pixels. Two frames with the same hash are the same frame, delivered twice. 0: the content
  /// proves nothing (all black, all saturated, or a camera without noise).
  std::uint64_t content = 0;
};

/// The ledger's verdict on a frame.
enum class Verdict : std::uint8_t {
  certain,     ///< sequence number, stamp and content name the same exposure, and no other frame claims it
  guard,       ///< agrees with its neighbours, but was taken before the ledger locked: not used
  damaged,     ///< the driver reports that it is incomplete
  duplicated,  ///< the same sequence number, exposure or content as another frame
  late,        ///< the stamp names a later exposure than the number, or the frame came after its run
  swapped,     ///< the stamp names an earlier exposure than the number
  extra,       ///< the stamp fits no exposure
  ambiguous,   ///< the stamp fits several exposures: the clock bounds are too wide
  doubtful     ///< next to a contradiction
};
std::string_view name(Verdict verdict);

/// Number of frames for each verdict.
struct FrameCounts {
  static constexpr std::size_t kVerdicts = 9;
  std::array<std::int64_t, kVerdicts> by_verdict{};
  std::int64_t missing = 0;  ///< exposures without a frame

  std::int64_t operator[](Verdict verdict) const { return by_verdict[static_cast<std::size_t>(verdict)]; }
  FrameCounts& operator+=(const FrameCounts& other);
  /// "1 missing, 2 late". Empty if all frames are certain or guards.
  std::string trouble() const;
};

/// The verdicts of one run.
struct RunIdentity {
  std::vector<Verdict> frames;                    ///< one for each frame
  std::vector<std::optional<std::size_t>> frame;  ///< for each exposure: the frame that certainly shows it
  FrameCounts counts;
};

struct LedgerOptions {
  /// How many frames in a row must agree after a stream starts before a frame is trusted. 0 = trust the first
  /// frame.
  int guards = 4;
  /// How far a stamp may be from the exposure's begin or end, in addition to the clock bounds.
  Nanoseconds tolerance{200'000};
  /// StampOf::exposure_end: how late after the end of the exposure a stamp may come.
  Nanoseconds readout{3'000'000};
};

/// Finds which frame shows which exposure (docs/ledger.md). Two independent witnesses name the exposure of a
/// frame. One is its sequence number, counted from the point where the ledger locked. The other is its stamp,
/// compared with the board's stamps of the exposures. The third witness, the content, finds copies. A frame
/// is certain if three conditions hold: the ledger is locked, the witnesses agree, and no witness puts
/// another frame at the same exposure. The number of frames is no witness: one loss and one copy leave it
/// unchanged.
///
/// A contradiction unlocks the ledger. It locks again when as many frames in a row agree as there are guards,
/// at least three. A camera without stamps: see docs/ledger.md.
/// again where they agree. A camera without stamps: see docs/ledger.md.
class CameraLedger {
 public:
  explicit CameraLedger(const LedgerOptions& options = {}) : options_(options) {}

  /// exposures: all exposures of a run in order of time. frames: all frames since the last call in order of
  /// arrival. Without exposures, all frames are left over from earlier runs.
  RunIdentity judge(std::span<const SeenExposure> exposures, std::span<const SeenFrame> frames);

  /// The camera has restarted its stream: its sequence numbers begin again.
  void restart();
  /// The board has lost count of the exposures.
  void doubt();
  bool locked() const { return offset_.has_value(); }
  /// true: guard frames must be taken before photographs.
  bool needs_guards() const { return !locked() && guards_needed() > 0; }
  /// How many guard frames in a row must agree.
  int guards_needed() const;
  const LedgerOptions& options() const { return options_; }

 private:
  class Run;
  void unlock();
  /// Records a frame whose stamp gives this offset between numbers and exposures. true: the ledger is locked
  /// now.
  bool agree(std::int64_t offset);
  bool is_copy(std::uint64_t content) const;
  void remember(std::span<const SeenExposure> exposures);

  LedgerOptions options_;
  std::int64_t first_ = 0;                 // of the run's first exposure, from the stream's start
  std::optional<std::int64_t> offset_;     // sequence number of exposure 0
  std::optional<std::int64_t> candidate_;  // the same, not trusted yet
  int agreed_ = 0;                         // frames in a row that agree with the candidate
  bool contradicted_ = false;              // since the start of the stream
  bool stamped_ = false;                   // a frame since the start of the stream had a stamp
  bool ended_with_gap_ = false;            // the last exposure of the previous run has no frame
  std::deque<SeenExposure> past_;          // the exposures before first_, newest last
  std::deque<std::uint64_t> contents_;     // of the newest frames
};

}  // namespace symrig
