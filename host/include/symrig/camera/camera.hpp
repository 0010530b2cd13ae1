// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/board/clock_time.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/image.hpp"

#include <any>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace symrig {

/// What a camera can do with its shutter.
struct CameraTiming {
  Nanoseconds min_exposure{20'000};
  Nanoseconds max_exposure{30'000'000'000};
  Nanoseconds readout{3'000'000};  ///< from the end of an exposure to the next possible trigger
};

/// What the time-stamp of a frame tells.
enum class StampOf : std::uint8_t {
  nothing,  ///< the camera has no clock that we share
  exposure_begin,
  exposure_end  ///< end of the exposure or later, up to the end of the readout
};

/// One frame as the camera hands it over. raw: channels × grid codes, planar, raster order.
struct CameraFrame {
  std::uint64_t sequence = 0;  ///< the camera's own count of frames, with those it lost on the way
  SteadyTime stamp;
  StampOf stamp_of = StampOf::nothing;
  bool damaged = false;  ///< the driver says that its contents are not whole
  std::vector<std::uint16_t> raw;
  /// What a camera adds for a FrameReading of its own, such as chunk data; empty for most.
  std::any attachment = {};
};

/// A camera that exposes while its trigger line is high. The board times the exposures; the camera only
/// hands over what it saw. Not thread-safe.
class Camera {
 public:
  Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;
  virtual ~Camera() = default;

  virtual Grid grid() const = 0;
  virtual int channels() const = 0;
  virtual CameraTiming timing() const = 0;
  virtual const NoiseModel& noise() const = 0;
  /// Pixels never to be trusted: 1 = dead, grid × 1. nullptr: none known.
  virtual const Image<std::uint8_t>* dead() const = 0;
  /// All frames since the last take(), in order of arrival. Waits until there are `count` of them or none has
  /// come for `patience`: may be fewer than asked for, or more. Which belongs to which exposure is the
  /// ledger's to say.  fails: device_lost.
  virtual Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) = 0;
  /// One line for reports.
  virtual std::string describe() const = 0;
};

}  // namespace symrig
