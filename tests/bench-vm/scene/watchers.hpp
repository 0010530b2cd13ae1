// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/delivery.hpp"
#include "bench-vm/scene/screen_reader.hpp"
#include "bench-vm/scene/stage.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/time.hpp"

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace symrig::bench_vm {

/// The timing of a camera in trigger-width mode, as board_sim::SimCamera has in virtual time. It exposes
/// while its trigger line is high. It misses a trigger that rises while it reads out the previous frame.
class Shutter {
 public:
  enum class Move : std::uint8_t { none, open, close };

  explicit Shutter(Nanoseconds readout) : readout_(readout) {}

  /// The trigger line was set, possibly to the level that it had.
  /// sees: the camera sees it if it rises. One that it does not see gives no exposure.
  Move trigger(bool level, Nanoseconds at, bool sees = true);
  /// Number of times that the line rose.
  std::uint64_t triggers() const { return triggers_; }
  /// Number of triggers that came too early.
  std::uint64_t missed() const { return missed_; }
  /// Number of triggers that were not seen.
  std::uint64_t unseen() const { return unseen_; }
  bool is_open() const { return open_; }

 private:
  Nanoseconds readout_;
  Nanoseconds busy_until_{};
  std::uint64_t triggers_ = 0;
  std::uint64_t missed_ = 0;
  std::uint64_t unseen_ = 0;
  bool level_ = false;
  bool open_ = false;
};

/// An output line was set. The kernel's trace has every call, even if the level does not change.
struct LineSet {
  int gpio = 0;  ///< the kernel's global number of the line
  bool level = false;
  Nanoseconds time{};  ///< CLOCK_MONOTONIC, whole microseconds, as trace_pipe prints
  bool operator==(const LineSet&) const = default;
};

/// The trace buffer overflowed: it is unknown which lines were set in the meantime.
struct EventsLost {
  std::uint64_t count = 0;
  bool operator==(const EventsLost&) const = default;
};

/// monostate: a reading of a line, another event, or a comment.
using TraceEvent = std::variant<std::monostate, LineSet, EventsLost>;

/// One line of tracefs' trace_pipe with trace_clock=mono, without its line feed.
/// source: Linux 6.1, include/trace/events/gpio.h (gpio_value), kernel/trace/trace.c ("LOST n EVENTS").
TraceEvent parse_trace_line(std::string_view line);

/// Joins the pieces that read() returns to complete lines. The rest waits for the next piece.
class LineSplitter {
 public:
  /// The lines that end in this piece, in order, without line feeds.
  std::vector<std::string> feed(std::string_view piece);

 private:
  std::string rest_;
};

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

/// A controller of bit planes between the screen and the scene. It reads the screen after each refresh. One
/// refresh later it shows the planes of that picture, with an edge of its trigger outputs for each.
class PlaneWatch {
 public:
  /// None: the controller shows no planes.
  using Controller = std::function<std::optional<ShownSequence>()>;

  /// stage must outlive the watch.  fails: as ScreenReader::open, InputWire::open.
  static Result<std::unique_ptr<PlaneWatch>> open(const BenchPlaces& places, const Placement& placement,
                                                  Controller controller, Stage& stage);

  /// Reads the screen until the stage is stopped.
  void run();
  /// Makes the edges until the stage is stopped. Runs beside run().
  void run_triggers();

  std::uint64_t refreshes() const { return refreshes_; }
  /// Refreshes whose picture was not read in time. They stay dark and have no edges.
  std::uint64_t missed() const { return missed_; }
  /// The largest delay of an edge.
  Nanoseconds latest() const { return latest_; }

 private:
  PlaneWatch(ScreenReader screen, const Placement& placement, InputWire frame, InputWire plane,
             Controller controller, Stage& stage)
      : screen_(std::move(screen)),
        placement_(placement),
        frame_(std::move(frame)),
        plane_(std::move(plane)),
        controller_(std::move(controller)),
        stage_(stage) {}
  void follow();
  void show(const Refresh& refresh, Nanoseconds period);
  std::optional<TriggerEdge> next_edge();
  Result<void> make(const TriggerEdge& edge);

  ScreenReader screen_;
  Placement placement_;
  InputWire frame_, plane_;
  Controller controller_;
  Stage& stage_;
  std::optional<Refresh> last_;
  std::uint64_t refreshes_ = 0;
  std::uint64_t missed_ = 0;
  Nanoseconds latest_{0};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<TriggerEdge> edges_;
  std::deque<TriggerEdge> taken_;  // by the thread that makes them
};

}  // namespace symrig::bench_vm
