// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/screen_reader.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace symrig::bench_vm {

/// What goes wrong with a controller of bit planes.
struct ControllerFault {
  enum class Kind : std::uint8_t {
    table,  ///< it changes an entry of each pattern table that it gets, until its power is cycled
    reset,  ///< it loses its settings in the middle of a sequence
    stall,  ///< it does not answer the next three commands
    hang    ///< it answers nothing until its power is cycled
  };
  Kind kind = Kind::reset;
  std::uint64_t after = 0;  ///< exposures since its power came on
};

/// "KIND@EXPOSURES", such as "reset@40".
/// fails: bad_argument.
Result<ControllerFault> parse_controller_fault(const std::string& text);

/// An emulated controller of bit planes behind USB/IP (`usbip attach -r 127.0.0.1 -b 1-1`). Thread-safe.
class SceneController {
 public:
  /// kind: "dlpc350" or "dlpc900". The faults come one after the other, and none while one lasts. Call it
  /// before priorities are raised.
  /// port: of its USB/IP server. 0: any that is free.
  /// fails: bad_argument, io (the port is taken).
  static Result<std::shared_ptr<SceneController>> serve(const std::string& kind,
                                                        std::vector<ControllerFault> faults,
                                                        std::uint16_t port = 3240);
  SceneController() = default;
  SceneController(const SceneController&) = delete;
  SceneController& operator=(const SceneController&) = delete;
  virtual ~SceneController() = default;

  /// Call it once in each refresh, with the number of exposures so far.
  /// Returns what it shows in the next refresh. None: nothing.
  virtual std::optional<ShownSequence> next_refresh(std::uint64_t exposures) = 0;
  /// Its power goes off and on: it has the settings of its flash, and no fault.
  virtual void cycle_power(std::uint64_t exposures) = 0;
  /// Faults that have come so far.
  virtual std::size_t faults() const = 0;
};

}  // namespace symrig::bench_vm
