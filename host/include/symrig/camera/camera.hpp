// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/clock_model.hpp"
#include "symrig/camera/frame_format.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/image.hpp"

#include <any>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace symrig {

/// The limits of a camera's shutter.
struct CameraTiming {
  Nanoseconds min_exposure{20'000};
  Nanoseconds max_exposure{30'000'000'000};
  Nanoseconds readout{3'000'000};  ///< from the end of an exposure until the frame is read out
  /// From an edge of the trigger to what it does. The begin and the end of an exposure are both late by it.
  Nanoseconds trigger_delay{0};
  /// The camera takes a trigger this long before the end of a readout. The exposure must end after the
  /// readout.
  Nanoseconds overlap{0};
};

/// Which moment a frame's time stamp marks.
enum class StampOf : std::uint8_t {
  nothing,  ///< the camera shares no clock with the host
  exposure_begin,
  exposure_end  ///< the end of the exposure or later, at the latest the end of the readout
};

/// One frame as the camera delivers it. raw: channels × grid codes, planar, raster order.
struct CameraFrame {
  std::uint64_t sequence = 0;  ///< the camera's own frame count; lost frames count too
  SteadyTime stamp;
  StampOf stamp_of = StampOf::nothing;
  bool damaged = false;  ///< the driver reports that the contents are incomplete
  std::vector<std::uint16_t> raw;
  /// Extra data for the camera's own FrameReading, such as chunk data. Most cameras leave it empty.
  std::any attachment = {};
  std::size_t camera = 0;  ///< which one of several cameras on one trigger: Camera::part(camera)
};

/// A camera that exposes while its trigger line is high. The board times the exposures. The camera only
/// delivers the frames. Not thread-safe.
class Camera {
 public:
  Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;
  virtual ~Camera() = default;

  virtual Grid grid() const = 0;
  virtual int channels() const = 0;
  /// The colour filters of its pixels, whose samples are one channel.
  virtual Mosaic mosaic() const { return Mosaic::none; }
  virtual CameraTiming timing() const = 0;
  virtual const NoiseModel& noise() const = 0;
  /// Defective pixels: 1 = dead, grid × 1. nullptr: none known.
  virtual const Image<std::uint8_t>* dead() const = 0;
  /// Returns all frames since the last take(), in order of arrival. Waits for `count` frames, but stops
  /// waiting after `patience` without a new frame. The result may have fewer or more than `count` frames. The
  /// ledger decides which frame belongs to which exposure.
  /// fails: device_lost.
  virtual Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) = 0;
  /// How many cameras deliver these frames. Several cameras expose together, on one trigger line.
  virtual std::size_t count() const { return 1; }
  /// The camera whose frames have CameraFrame::camera == index.
  virtual const Camera& part(std::size_t /*index*/) const { return *this; }
  /// One line for reports.
  virtual std::string describe() const = 0;
};

/// Counts all frames since the camera was opened. Every dropped frame is counted here. A missing frame also
/// leaves a gap in CameraFrame::sequence.
struct StreamReport {
  std::uint64_t delivered = 0;   ///< returned by take(), or waiting in the queue
  std::uint64_t missing = 0;     ///< frame numbers that the driver skipped: lost frames
  std::uint64_t overflowed = 0;  ///< lost because the queue was full: take() was not called in time
  std::uint64_t stale = 0;       ///< older than the start of the stream; discarded
  std::uint64_t damaged = 0;     ///< delivered, but marked damaged by the driver, or too short
  std::uint64_t repeated = 0;    ///< delivered with the same number as the frame before
  std::uint64_t reordered = 0;   ///< delivered with a lower number than the frame before
  std::uint64_t unstamped = 0;   ///< delivered without a usable time stamp
  std::uint64_t errors = 0;      ///< attempts to take a frame that failed with a driver error
  std::uint64_t restarts = 0;    ///< how often the stream was reopened
  /// Remarks about the driver, each once: stamps of another clock, samples with more bits than stated, and so
  /// on.
  std::vector<std::string> notes;

  /// "812 frames, 2 missing, 1 damaged". Leaves out zeros.
  std::string to_string() const;
};

}  // namespace symrig
