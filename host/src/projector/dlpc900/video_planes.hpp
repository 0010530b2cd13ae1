// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlpc900/saved_state.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace symrig::projector::dlpc900 {

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
