// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"
#include "symrig/projector/find_projectors.hpp"
#include "symrig/projector/internal/dlp.hpp"
#include "symrig/projector/internal/planes.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace symrig::projector::dlpc900 {

/// An entry of the pattern table (DLPU018J, "Pattern Display LUT Definition"). The controller does not tell
/// its entries again.
struct TableEntry {
  int index = 0;
  std::uint32_t exposure_us = 0;  ///< 24 bits
  int bits = 1;                   ///< bit depth, 1 to 8
  std::uint8_t leds = dlp::kAllLeds;
  bool waits = false;         ///< for the trigger; in video-pattern mode VSYNC
  bool clears = false;        ///< black after the pattern; only 1-bit patterns with a trigger
  std::uint32_t dark_us = 0;  ///< after the exposure, 24 bits
  bool no_trigger_2 = false;  ///< TRIG_OUT_2 has no pulse
  int bit = 0;                ///< of the picture's 24: the first one of the pattern
  bool operator==(const TableEntry&) const = default;
};
inline constexpr std::size_t kEntryBytes = 12;
dlp::Bytes to_bytes(const TableEntry& entry);

/// The table of a video sequence: entry k shows bit k. VSYNC begins it (DLPU018J, table 5-1). The last entry
/// is cleared, so that nothing is bright until then: a public program for this mode found that it stays else
/// (importly/dmdcontrol, display_sequence.py).
std::vector<TableEntry> video_table(const dlp::Sequence& sequence);

/// The least exposure of a 1-bit pattern of the DLP6500 and the DLP9000 is 105 us (DLPU018J, "Minimum
/// Exposure in Any Pattern Mode"), as long as the black before a pattern with a trigger. A sequence that has
/// not ended at the next VSYNC is broken off (section 5.1). A public program for this mode leaves 250 us
/// (importly/dmdcontrol, constants.py); so does symrig.
inline constexpr dlp::PlaneLimits kPlaneLimits{105, 250};

/// What "Reading Hardware Configuration" tells (DLPU018J, 0x0206).
struct Mirrors {
  std::string_view name;
  Grid grid;
};
/// None: an unknown kind.
std::optional<Mirrors> mirrors_of(std::uint8_t type);

/// A trigger output (DLPU018J, "Trigger Out 1"). Delays in microseconds, -20 to 20,000. TRIG_OUT_1 is active
/// while a pattern is bright: `rising` counts from its begin, `falling` from its end. TRIG_OUT_2 has a pulse
/// at the begin of each pattern: both count from there.
struct TriggerOut {
  bool inverted = false;
  std::int16_t rising = 0, falling = 0;
  bool operator==(const TriggerOut&) const = default;
};
/// fails: bad_argument (outside of the range).
Result<std::int16_t> delay_us(Nanoseconds delay);

/// What the controller shows (DLPU018J, "Display Mode Selection").
enum class ControllerMode : std::uint8_t {
  video = 0,
  stored_patterns = 1,
  video_patterns = 2,
  loaded_patterns = 3
};
std::string_view name_of(ControllerMode mode);

/// The table that is used: its entries, and how many patterns are shown.
struct Counts {
  int entries = 0;
  std::uint32_t shown = 0;  ///< 0: the sequence repeats
  bool operator==(const Counts&) const = default;
};

/// A DLPC900, command by command. Each call fails as dlp::Dialogue does.
class Controller : public dlp::Controller {
 public:
  explicit Controller(std::unique_ptr<dlp::HidTransport> transport,
                      Nanoseconds patience = Nanoseconds{1'000'000'000})
      : dlp::Controller(std::move(transport), 6, patience) {}

  /// The number of its kind of mirrors: mirrors_of().
  Result<std::uint8_t> mirrors();
  /// The rate comes from the pixel clock and the totals of lines and pixels.
  Result<dlp::Signal> signal();
  Result<ControllerMode> display_mode();
  Result<void> set_display_mode(ControllerMode mode);
  Result<std::uint8_t> receiver();
  Result<void> set_receiver(std::uint8_t receiver);
  Result<Counts> counts();
  Result<void> set_counts(const Counts& counts);
  /// The entries become effective with set_counts().
  Result<void> set_table(const std::vector<TableEntry>& entries);
  /// number: 1 or 2.
  Result<TriggerOut> trigger_out(int number);
  Result<void> set_trigger_out(int number, const TriggerOut& out);
};

/// The controller has locked to the signal at its input (main status, bit 3).
constexpr bool is_locked(const dlp::Status& status) {
  return (status.main & 0x08U) != 0;
}

/// The settings of a controller that a video sequence changes, as far as the controller tells them. It does
/// not tell its pattern table, nor whether an earlier sequence was started.
struct SavedState {
  ControllerMode mode = ControllerMode::video;
  std::uint8_t source = 0;
  std::uint8_t receiver = 0;
  TriggerOut frame_trigger, plane_trigger;  ///< TRIG_OUT_1, TRIG_OUT_2
  dlp::LedEnable led_enable;
  dlp::LedCurrents led_currents{};
  bool operator==(const SavedState&) const = default;
};

/// Changes nothing. fails: as Controller.
Result<SavedState> read_state(Controller& controller);

/// Stops the sequence if one can run, goes to video mode, and writes the settings but the mode. The LEDs come
/// last: while the rest changes, no LED is brighter than it was. A setting that cannot be written does not
/// keep the others from being written. fails: with the first error, as Controller.
Result<void> write_settings(Controller& controller, const SavedState& state);

/// write_settings(), then the mode. Its patterns stand still. fails: as write_settings().
Result<void> restore_state(Controller& controller, const SavedState& state);

/// Reads a controller's state into `found`. Changes nothing. fails: as Controller.
Result<void> look(Controller& controller, DlpController& found);

/// The connector of the LightCrafter's video receiver (DLPU018J, "IT6535 Power Mode").
enum class Port : std::uint8_t { hdmi = 1, display_port = 2 };

/// What a video sequence shall be. TRIG_OUT_2 is the plane trigger: a pulse at the begin of each plane.
/// TRIG_OUT_1 is the frame trigger: planes without dark time between them are one pulse of it.
struct VideoPlaneOptions : dlp::PlaneOptions {
  /// That the screen's cable feeds. None: the receiver stays as it is.
  std::optional<Port> port = Port::hdmi;
  /// A change to video-pattern mode takes about 300 ms, and before that the mode reads wrong (DLPU018J,
  /// "Display Mode Selection").
  Nanoseconds mode_time{300'000'000};
  /// Longest wait after that until the mode is there, and until the sequence runs.
  Nanoseconds patience{2'000'000'000};
};

/// A DLPC900 in video-pattern mode: it splits each picture of its video port into bit planes.
///
/// begin() reads what the controller tells of its state. It writes everything while the controller shows
/// video, waits until the controller has locked to the signal, changes the mode, writes the table, and starts
/// the sequence. The table cannot be read back: only light proves it (docs/howto-projectors.md). The
/// destructor puts back the state that begin() found, without the table, also if begin() failed half-way.
class VideoPlanes final : public dlp::PlaneSequence {
 public:
  /// fails: bad_argument and limit (a sequence that the controller cannot show), device_refused (standby,
  /// unknown mirrors, no signal, another mode than the screen's, a setting that reads back differently, a
  /// sequence that does not run), as Controller.
  static Result<std::unique_ptr<VideoPlanes>> begin(Controller controller, const dlp::PictureSource& source,
                                                    const VideoPlaneOptions& options);
  ~VideoPlanes() override;
  VideoPlanes(const VideoPlanes&) = delete;
  VideoPlanes& operator=(const VideoPlanes&) = delete;

  const dlp::Sequence& sequence() const override { return sequence_; }
  const std::string& name() const override { return name_; }
  dlp::Version version() const override { return version_; }
  Result<void> check() override;
  std::vector<std::string> warnings() const override { return warnings_; }
  /// Puts back the state that begin() found. The destructor does it too, but cannot report an error.
  Result<void> end();

 private:
  explicit VideoPlanes(Controller controller);
  Result<void> await_signal(const dlp::PictureSource& source, Nanoseconds patience);
  Result<void> write(const VideoPlaneOptions& options);
  Result<void> enter_pattern_mode(const VideoPlaneOptions& options);
  Result<void> write_table();
  Result<void> start(Nanoseconds patience);
  Result<bool> runs();

  Controller controller_;
  std::string name_;
  dlp::Version version_;
  Grid mirrors_;
  dlp::Sequence sequence_;
  SavedState wanted_;
  Counts counts_;
  std::vector<std::string> warnings_;
  std::optional<SavedState> found_;  // until it is put back
};

}  // namespace symrig::projector::dlpc900
