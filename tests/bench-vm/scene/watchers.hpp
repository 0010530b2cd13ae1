// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/frame_faults.hpp"
#include "bench-vm/scene/screen_reader.hpp"
#include "bench-vm/scene/shutter.hpp"
#include "bench-vm/scene/stage.hpp"
#include "bench-vm/scene/trace_line.hpp"
#include "symrig/base/files.hpp"

#include <cstdint>
#include <optional>
#include <string_view>

namespace symrig::bench_vm {

/// Follows the camera's trigger through the kernel's trace and sets its strobe at once. The strobe's edges
/// are begin and end of the exposure.
class TriggerWatch {
 public:
  /// stage must outlive the watch.
  /// fails: unknown_name (a line), io.
  /// faults: which triggers the camera does not see.
  static Result<TriggerWatch> open(const BenchPlaces& places, Nanoseconds readout, const FaultRates& faults,
                                   Stage& stage);

  /// Runs until the stage is stopped. It stops the stage itself if trace events were lost, because the
  /// board's actions are then unknown.
  void run();

  std::uint64_t exposures() const { return exposures_; }
  std::uint64_t missed() const { return shutter_.missed(); }
  std::uint64_t unseen() const { return shutter_.unseen(); }
  /// The longest time from a trigger's edge to the strobe's.
  Nanoseconds slowest() const { return slowest_; }

 private:
  TriggerWatch(Fd trace, InputWire strobe, int gpio, Nanoseconds readout, const FaultRates& faults,
               Stage& stage)
      : trace_(std::move(trace)),
        strobe_(std::move(strobe)),
        gpio_(gpio),
        shutter_(readout),
        faults_(faults),
        stage_(stage) {}
  Result<void> read_on();
  Result<void> take(const TraceEvent& event);
  Result<void> move(const LineSet& set);

  Fd trace_;
  InputWire strobe_;
  int gpio_;
  Shutter shutter_;
  FaultRates faults_;
  Stage& stage_;
  LineSplitter lines_;
  Moment begin_;
  std::uint64_t exposures_ = 0;
  Nanoseconds slowest_{0};
};

/// Follows a screen: reads it after each refresh. The first screen pulses the vsync line as a projector does.
class RefreshWatch {
 public:
  /// screen: its number on the stage, 0 for the first. stage must outlive the watch.
  /// fails: as ScreenReader::open, InputWire::open.
  static Result<RefreshWatch> open(const BenchPlaces& places, std::size_t screen, const Placement& placement,
                                   Stage& stage);

  /// Runs until the stage is stopped.
  void run();

  std::uint64_t refreshes() const { return refreshes_; }
  /// Refreshes that ended before they were read.
  std::uint64_t missed() const { return missed_; }

 private:
  RefreshWatch(ScreenReader screen, std::size_t number, std::optional<InputWire> vsync, Stage& stage)
      : screen_(std::move(screen)), number_(number), vsync_(std::move(vsync)), stage_(stage) {}
  Result<void> follow();
  void count(const Refresh& refresh);

  ScreenReader screen_;
  std::size_t number_;
  std::optional<InputWire> vsync_;
  Stage& stage_;
  std::optional<std::uint64_t> last_;
  std::uint64_t refreshes_ = 0;
  std::uint64_t missed_ = 0;
};

}  // namespace symrig::bench_vm
