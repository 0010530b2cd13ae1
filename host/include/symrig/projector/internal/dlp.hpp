// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/projector/find_projectors.hpp"
#include "symrig/projector/internal/dlp_link.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

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

/// Does several steps one after the other and keeps the first error.
class Steps {
 public:
  /// A step that fails is done again: one lost answer must not leave a controller half-way.
  static constexpr int kTries = 3;

  template <class Step>
  void take(Step step) {
    Result<void> done = step();
    for (int tries = 1; !done && done.error().code != ErrorCode::device_lost && tries < kTries; ++tries)
      done = step();
    if (first_ && !done) first_ = std::move(done);
  }
  Result<void> result() && { return std::move(first_); }

 private:
  Result<void> first_;
};

struct Version {
  int major = 0, minor = 0, patch = 0;
  bool operator==(const Version&) const = default;
};
std::string to_string(const Version& version);

/// The state bytes of a controller (DLPU010 and DLPU018, "Status Commands").
struct Status {
  std::uint8_t hardware = 0, system = 0, main = 0;

  bool initialized() const { return (hardware & 0x01U) != 0; }
  bool sequencer_aborted() const { return (hardware & 0x40U) != 0; }
  bool sequencer_error() const { return (hardware & 0x80U) != 0; }
  bool parked() const { return (main & 0x01U) != 0; }      ///< the mirrors
  bool sequencing() const { return (main & 0x02U) != 0; }  ///< the sequencer runs
  bool frozen() const { return (main & 0x04U) != 0; }      ///< pictures are not swapped
};

enum class Run : std::uint8_t { stop = 0, pause = 1, start = 2 };

/// LEDs by bits: red, green, blue.
inline constexpr std::uint8_t kAllLeds = 7;

/// LEDs and who switches them.
struct LedEnable {
  std::uint8_t leds = kAllLeds;
  bool by_sequencer = true;
  bool operator==(const LedEnable&) const = default;
};
using LedCurrents = std::array<std::uint8_t, 3>;  ///< red, green, blue; 255 is the most

/// What a DLPC350 and a DLPC900 have in common, command by command. Each call fails as Dialogue does.
class Controller {
 public:
  std::string name() const { return dialogue_.name(); }
  /// Version of the application in the controller's flash.
  Result<Version> version();
  Result<Status> status();
  Result<bool> standby();
  Result<std::uint8_t> source();  ///< port and width, as one byte
  Result<void> set_source(std::uint8_t source);
  Result<LedEnable> led_enable();
  Result<void> set_led_enable(const LedEnable& enable);
  Result<LedCurrents> led_currents();
  Result<void> set_led_currents(const LedCurrents& currents);
  Result<void> set_run(Run run);

 protected:
  /// firmware: the major version for which symrig was written.
  Controller(std::unique_ptr<HidTransport> transport, int firmware, Nanoseconds patience)
      : dialogue_(std::move(transport), firmware, patience) {}
  Result<std::uint8_t> byte(Command command);
  Dialogue& dialogue() { return dialogue_; }

 private:
  Dialogue dialogue_;
};

/// fails: device_refused (in standby, not initialized, or an error of its sequencer), as Controller.
Result<void> check_ready(Controller& controller);

/// Reads into `found` what every controller tells. Changes nothing. fails: as Controller.
Result<void> look_at_common(Controller& controller, DlpController& found);

inline DlpSignal described(const Signal& signal) {
  return {signal.locked, {signal.rows, signal.cols}, signal.refresh_hz};
}

}  // namespace symrig::projector::dlp
