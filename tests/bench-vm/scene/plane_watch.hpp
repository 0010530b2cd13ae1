// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/plane_light.hpp"
#include "bench-vm/scene/stage.hpp"

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

namespace symrig::bench_vm {

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
