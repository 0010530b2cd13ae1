// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlpc350/saved_state.hpp"
#include "symrig/image/grid.hpp"

#include <memory>
#include <optional>
#include <string>

namespace symrig::projector::dlpc350 {

/// What a video sequence shall be.
struct VideoPatternOptions {
  int planes = kMostPlanes;                  ///< in each picture
  std::optional<std::uint32_t> period_us;    ///< from plane to plane; none: the longest that fits
  std::optional<std::uint32_t> exposure_us;  ///< none: the period
  std::uint8_t leds = kAllLeds;
  std::optional<LedCurrents> led_currents;              ///< none: as they are
  Port port = Port::parallel;                           ///< that the screen's cable feeds
  bool plane_inverted = false, frame_inverted = false;  ///< TRIG_OUT_1, TRIG_OUT_2 active low
  Nanoseconds plane_delay{0};                           ///< of both edges of TRIG_OUT_1 against the plane
  /// Of TRIG_OUT_2 against the first plane. It comes before the first edge of TRIG_OUT_1, so that the order
  /// of the two is certain.
  Nanoseconds frame_delay{-20'000};
  Nanoseconds lock_patience{5'000'000'000};  ///< longest wait until the controller has locked to the signal
};

/// The picture source as the host knows it.
struct PictureSource {
  Grid grid;            ///< rows x columns of its mode
  Nanoseconds refresh;  ///< of its mode
};

/// A controller in video-pattern mode: it splits each picture of its video port into bit planes.
///
/// begin() reads the controller's state, refuses a wrong configuration while no sequence runs, then writes
/// the sequence, reads it back, lets the controller check it, and starts it. The destructor puts back the
/// state that begin() found, also if begin() failed half-way.
class VideoPatterns {
 public:
  /// fails: bad_argument and limit (a sequence that the controller cannot show), device_refused (standby, no
  /// signal, another mode than the screen's, a read-back that differs, a check that failed), as Controller.
  static Result<std::unique_ptr<VideoPatterns>> begin(Controller controller, const PictureSource& source,
                                                      const VideoPatternOptions& options);
  ~VideoPatterns();
  VideoPatterns(const VideoPatterns&) = delete;
  VideoPatterns& operator=(const VideoPatterns&) = delete;

  const Sequence& sequence() const { return sequence_; }
  const std::string& name() const { return name_; }
  Version version() const { return version_; }
  /// Checks that the sequence still runs, with the table that begin() wrote.
  /// fails: device_lost (it was reset, or another program changed it), as Controller.
  Result<void> check();
  /// Puts back the state that begin() found. The destructor does it too, but cannot report an error.
  Result<void> end();

 private:
  explicit VideoPatterns(Controller controller);
  Result<void> check_device();
  Result<void> check_signal(const PictureSource& source);
  Result<void> await_signal(const PictureSource& source, Nanoseconds patience);
  Result<void> write(const VideoPatternOptions& options);
  Result<void> read_back();
  Result<void> start();

  Controller controller_;
  std::string name_;
  Version version_;
  Sequence sequence_;
  SavedState wanted_;
  std::optional<SavedState> found_;  // until it is put back
};

}  // namespace symrig::projector::dlpc350
