// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlpc350/saved_state.hpp"

#include <memory>
#include <optional>
#include <string>

namespace symrig::projector::dlpc350 {

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
