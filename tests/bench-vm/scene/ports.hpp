// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::bench_vm {

/// Paths and names of the guest's devices, from the environment that the runner set up.
struct BenchPlaces {
  std::string gpio_sysfs;               ///< BENCH_GPIO_SYSFS: folder of the lines' pull files
  int gpio_base = 0;                    ///< BENCH_GPIO_BASE: the kernel's number of the first line
  std::vector<std::string> gpio_lines;  ///< BENCH_GPIO_LINES, in order
  std::string tracefs;                  ///< BENCH_TRACEFS
  std::string screen;                   ///< BENCH_VKMS: the card whose screen lights the scene

  /// fails: not_found (outside the guest, or without that device).
  static Result<BenchPlaces> from_environment();
  /// The card of screen 0, or of screen 1 (BENCH_VKMS_B).
  /// fails: not_found (the guest has no second screen).
  Result<std::string> screen_of(std::size_t number) const;
  /// Offset of a line on the chip.  fails: unknown_name.
  Result<int> line(std::string_view name) const;
};

/// A variable that the runner set in the guest.  fails: not_found.
Result<std::string> bench_variable(const char* name);

/// The time of an event, with its greatest error in both directions.
struct Moment {
  Nanoseconds time{};
  Nanoseconds doubt{};
};

/// An input of the simulated GPIO chip from outside, like a wire.
class InputWire {
 public:
  /// fails: unknown_name, io.
  static Result<InputWire> open(const BenchPlaces& places, std::string_view line);
  /// Sets the wire's level. The kernel stamps the edge between begin and end of the call; the moment is the
  /// middle of the two.
  /// fails: io.
  Result<Moment> pull(bool high) const;

 private:
  InputWire(Fd file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}

  Fd file_;
  std::string name_;
};

/// The test camera's present settings.
struct CameraState {
  bool plugged = true;
  bool streaming = false;
  bool stamps_begin = false;   ///< stamps mark the begin of the exposure, not its end
  bool follows_pulse = false;  ///< exposes while its trigger is high
  bool is_y12 = false;
};

/// Delivers frames to the test camera (modules/testcam/testcam.h).
class CameraPort {
 public:
  struct Head {
    Nanoseconds stamp{};
    std::uint32_t skip = 0;  ///< sequence numbers skipped before this frame
    bool damaged = false;
  };
  enum class Taken : std::uint8_t { yes, not_streaming, unplugged };

  /// fails: io.
  static Result<CameraPort> open(const std::string& path);
  /// pixels: one frame in the format that the host has set.
  /// fails: size_mismatch (the host has set another size), io.
  Result<Taken> deliver(const Head& head, std::span<const std::uint8_t> pixels);
  /// fails: io (not a test camera).
  Result<CameraState> state() const;
  /// Unplugs the camera, or plugs it in.
  /// fails: io.
  Result<void> plug(bool in) const;

 private:
  explicit CameraPort(Fd file) : file_(std::move(file)) {}

  Fd file_;
  std::vector<std::uint8_t> buffer_;
};

/// The error for a failed call of the operating system.
Error system_error(std::string_view what, std::string_view hint);

/// Gives the calling thread this real-time priority (SCHED_FIFO).
/// fails: io (not permitted).
Result<void> set_priority(int priority);

/// As InputWire::pull, at the highest priority. With one processor, the board's process would otherwise run
/// between the edge's stamp and the clock reading here. usual: the caller's priority.
/// fails: also as set_priority.
Result<Moment> pull_undisturbed(const InputWire& wire, bool high, int usual);

}  // namespace symrig::bench_vm
