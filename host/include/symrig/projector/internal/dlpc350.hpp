// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/find_projectors.hpp"
#include "symrig/projector/internal/dlp.hpp"
#include "symrig/projector/internal/planes.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace symrig::projector::dlpc350 {

/// What begins a pattern (DLPU010, table 2-65).
enum class Trigger : std::uint8_t {
  internal = 0,
  rising = 1,  ///< an outer rising edge; in a video sequence VSYNC
  falling = 2,
  continues = 3  ///< the end of the pattern before
};

/// An entry of the pattern table (DLPU010, table 2-65).
struct TableEntry {
  Trigger trigger = Trigger::continues;
  int plane = 0;  ///< number of the pattern; for 1 bit the plane
  int bits = 1;   ///< bit depth, 1 to 8
  std::uint8_t leds = dlp::kAllLeds;
  bool inverted = false;
  bool black_after = false;   ///< black after the pattern; the controller needs 230 us for it
  bool swaps_buffer = false;  ///< the pattern is of the next picture
  bool joins = false;         ///< TRIG_OUT_1 stays high between the pattern before and this one
  bool operator==(const TableEntry&) const = default;
};

inline constexpr std::size_t kEntryBytes = 3;
std::array<std::uint8_t, kEntryBytes> to_bytes(const TableEntry& entry);
TableEntry entry_of(std::span<const std::uint8_t, kEntryBytes> bytes);

/// The table of a video sequence: plane k is entry k. VSYNC begins it, and black follows the last plane, so
/// that nothing is bright until the next picture.
std::vector<TableEntry> video_table(int planes, std::uint8_t leds);

/// Delay of a trigger output against its pattern. Unit 107.2 ns; 0xBB is no delay (DLPU010, "Trigger Out
/// Control").
inline constexpr int kNoDelay = 0xBB;
inline constexpr int kMostDelay = 0xD5;
inline constexpr double kDelayUnit = 107.2;  ///< ns

/// fails: bad_argument (outside of -20.05 us to +2.79 us).
Result<std::uint8_t> delay_code(Nanoseconds delay);

struct TriggerOut {
  bool inverted = false;  ///< active low
  std::uint8_t rising = kNoDelay;
  std::uint8_t falling = kNoDelay;  ///< TRIG_OUT_1 only
  bool operator==(const TriggerOut&) const = default;
};

/// The least exposure of a 1-bit pattern, and the time for black or dark time after it (DLPU010, "Pattern
/// Display Exposure and Frame Period", as TI's interface program checks them).
inline constexpr dlp::PlaneLimits kPlaneLimits{235, 230};

/// Port at which the controller takes pictures.
enum class Port : std::uint8_t { parallel = 0, test_pattern = 1, flash = 2, fpd_link = 3 };

/// Bits of the controller's own check of a sequence (DLPU010, "Validation Command").
struct Validation {
  std::uint8_t bits = 0;

  bool bad_times() const { return (bits & 0x01U) != 0; }
  bool bad_patterns() const { return (bits & 0x02U) != 0; }
  bool joined_triggers() const { return (bits & 0x04U) != 0; }  ///< a warning
  bool no_black() const { return (bits & 0x08U) != 0; }         ///< a warning
  bool short_load() const { return (bits & 0x10U) != 0; }       ///< period - exposure below 230 us
  /// A warning about black before the first pattern is no error: VSYNC begins it, and black is in the table.
  bool ok() const { return !bad_times() && !bad_patterns() && !joined_triggers(); }
};
std::string to_string(Validation validation);

struct Counts {
  int entries = 1;
  bool repeats = false;
  int patterns_a_trigger = 1;  ///< patterns from TRIG_OUT_2 to TRIG_OUT_2
  int images = 1;
  bool operator==(const Counts&) const = default;
};

struct Times {
  std::uint32_t exposure_us = 0, period_us = 0;
  bool operator==(const Times&) const = default;
};

/// A DLPC350, command by command. Each call fails as dlp::Dialogue does.
class Controller : public dlp::Controller {
 public:
  explicit Controller(std::unique_ptr<dlp::HidTransport> transport,
                      Nanoseconds patience = Nanoseconds{1'000'000'000})
      : dlp::Controller(std::move(transport), 3, patience) {}

  Result<dlp::Signal> signal();

  Result<bool> shows_patterns();
  Result<void> show_patterns(bool patterns);
  Result<std::uint8_t> pattern_source();
  Result<void> set_pattern_source(std::uint8_t source);
  Result<std::uint8_t> trigger_mode();
  Result<void> set_trigger_mode(std::uint8_t mode);
  Result<Times> times();
  Result<void> set_times(Times times);
  Result<Counts> counts();
  Result<void> set_counts(const Counts& counts);
  Result<std::vector<TableEntry>> table(int entries);
  Result<void> set_table(const std::vector<TableEntry>& entries);
  Result<bool> inverted();
  Result<void> set_inverted(bool inverted);
  /// number: 1 or 2.
  Result<TriggerOut> trigger_out(int number);
  Result<void> set_trigger_out(int number, const TriggerOut& out);
  Result<dlp::Run> run();
  /// Lets the controller check its sequence. fails: also timeout (it did not end).
  Result<Validation> validate();

 private:
  Result<void> close_table();
};

/// All settings of a controller that a video sequence changes.
struct SavedState {
  bool shows_patterns = false;
  std::uint8_t source = 0;
  std::uint8_t pattern_source = 0;
  std::uint8_t trigger_mode = 0;
  bool inverted = false;
  Times times;
  Counts counts;
  std::vector<TableEntry> table;
  TriggerOut plane_trigger, frame_trigger;  ///< TRIG_OUT_1, TRIG_OUT_2
  dlp::LedEnable led_enable;
  dlp::LedCurrents led_currents{};
  dlp::Run run = dlp::Run::stop;
  bool operator==(const SavedState&) const = default;
};

/// Reads the state and changes nothing but the table's door. fails: as Controller.
Result<SavedState> read_state(Controller& controller);

/// Stops the sequence, writes what differs, and starts the sequence again if one ran. A setting that cannot
/// be written does not keep the others from being written. fails: with the first error, as Controller.
Result<void> restore_state(Controller& controller, const SavedState& state);

/// Reads a controller's state into `found`. Changes nothing. fails: as Controller.
Result<void> look(Controller& controller, DlpController& found);

/// What a video sequence shall be. TRIG_OUT_1 is the plane trigger, TRIG_OUT_2 the frame trigger.
struct VideoPatternOptions : dlp::PlaneOptions {
  Port port = Port::parallel;  ///< that the screen's cable feeds
};

/// A controller in video-pattern mode: it splits each picture of its video port into bit planes.
///
/// begin() reads the controller's state, refuses a wrong configuration while no sequence runs, then writes
/// the sequence, reads it back, lets the controller check it, and starts it. The destructor puts back the
/// state that begin() found, also if begin() failed half-way.
class VideoPatterns final : public dlp::PlaneSequence {
 public:
  /// fails: bad_argument and limit (a sequence that the controller cannot show), device_refused (standby, no
  /// signal, another mode than the screen's, a read-back that differs, a check that failed), as Controller.
  static Result<std::unique_ptr<VideoPatterns>> begin(Controller controller, const dlp::PictureSource& source,
                                                      const VideoPatternOptions& options);
  ~VideoPatterns() override;
  VideoPatterns(const VideoPatterns&) = delete;
  VideoPatterns& operator=(const VideoPatterns&) = delete;

  const dlp::Sequence& sequence() const override { return sequence_; }
  const std::string& name() const override { return name_; }
  dlp::Version version() const override { return version_; }
  /// Checks that the sequence still runs, with the table that begin() wrote.
  /// fails: device_lost (it was reset, or another program changed it), as Controller.
  Result<void> check() override;
  /// Puts back the state that begin() found. The destructor does it too, but cannot report an error.
  Result<void> end();

 private:
  explicit VideoPatterns(Controller controller);
  Result<void> check_signal(const dlp::PictureSource& source);
  Result<void> write(const VideoPatternOptions& options);
  Result<void> read_back();
  Result<void> start();

  Controller controller_;
  std::string name_;
  dlp::Version version_;
  dlp::Sequence sequence_;
  SavedState wanted_;
  std::optional<SavedState> found_;  // until it is put back
};

}  // namespace symrig::projector::dlpc350
