// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/grid.hpp"

#include <functional>
#include <string>

namespace symrig::projector::dlp {

/// The video signal at the controller's input.
struct Signal {
  bool locked = false;
  int rows = 0, cols = 0;
  double refresh_hz = 0;  ///< 0: unknown
};

/// The picture source as the host knows it.
struct PictureSource {
  Grid grid;            ///< rows x columns of its mode
  Nanoseconds refresh;  ///< of its mode
};

/// Checks that the controller receives the pictures of the source. It bypasses its scaler in pattern mode, so
/// pictures must have the size of its mirrors. fails: device_refused (no signal, or another one).
Result<void> check_signal(const std::string& controller, const Signal& signal, const PictureSource& source,
                          Grid mirrors);

/// Waits for a success of `check`: after a change of mode, a controller needs a second or two until it has
/// locked to the signal. fails: as `check`, at once with other codes than device_refused.
Result<void> await_signal(const std::function<Result<void>()>& check, Nanoseconds patience);

}  // namespace symrig::projector::dlp
