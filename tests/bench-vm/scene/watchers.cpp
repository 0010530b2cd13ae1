// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/watchers.hpp"

#include "symrig/base/time.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <ctime>
#include <thread>
#include <utility>

namespace symrig::bench_vm {

namespace {

/// Below the trigger's watcher, because an exposure must not wait for a picture.
constexpr int kPriority = 47;
constexpr std::chrono::microseconds kPulse{100};  // as board_sim::SimProjectorConfig
constexpr std::chrono::milliseconds kScreenOff{5};

}  // namespace

Result<RefreshWatch> RefreshWatch::open(const BenchPlaces& places, std::size_t screen,
                                        const Placement& placement, Stage& stage) {
  SYMRIG_TRY(const std::string card, places.screen_of(screen));
  SYMRIG_TRY(ScreenReader reader, ScreenReader::open(card, placement));
  std::optional<InputWire> vsync;
  if (screen == 0) {
    SYMRIG_TRY(vsync, InputWire::open(places, "vsync"));
  }
  return RefreshWatch(std::move(reader), screen, std::move(vsync), stage);
}

void RefreshWatch::run() {
  if (auto first = set_priority(kPriority); !first) return stage_.stop(first.error());
  while (!stage_.stopped())
    if (auto followed = follow(); !followed) stage_.stop(followed.error());
}

Result<void> RefreshWatch::follow() {
  const auto refresh = screen_.wait_refresh();
  if (!refresh) {  // no mode is set yet, or no longer
    stage_.show(steady_now(), nullptr, number_);
    last_.reset();
    std::this_thread::sleep_for(kScreenOff);
    return {};
  }
  if (vsync_) SYMRIG_CHECK(pull_undisturbed(*vsync_, true, kPriority));
  count(*refresh);
  stage_.show(refresh->begin, screen_.read(), number_);
  if (!vsync_) return {};
  std::this_thread::sleep_for(kPulse);
  SYMRIG_CHECK(pull_undisturbed(*vsync_, false, kPriority));
  return {};
}

void RefreshWatch::count(const Refresh& refresh) {
  ++refreshes_;
  if (last_ && refresh.number > *last_ + 1) missed_ += refresh.number - *last_ - 1;
  last_ = refresh.number;
}

namespace {

constexpr int kScreenPriority = 47;   // as the watcher of a screen without planes
constexpr int kTriggerPriority = 60;  // above the board's player: edges come from a device of their own
constexpr std::chrono::milliseconds kScreenIsOff{5};
constexpr std::chrono::milliseconds kStopLatency{100};
constexpr Nanoseconds kReadIn{8'000'000};  // a picture that is read later may be that of the next refresh
/// Planes begin this long after a refresh of the screen, whose interrupt would delay the first edges.
constexpr Nanoseconds kAfterRefresh{1'000'000};
/// The thread that makes an edge is awake this long before it.
constexpr Nanoseconds kAwake{40'000};

void sleep_until(Nanoseconds time) {
  const timespec at{time.count() / 1'000'000'000, time.count() % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
  }
}

}  // namespace

Result<std::unique_ptr<PlaneWatch>> PlaneWatch::open(const BenchPlaces& places, const Placement& placement,
                                                     Controller controller, Stage& stage) {
  SYMRIG_TRY(ScreenReader screen, ScreenReader::open(places.screen, placement));
  SYMRIG_TRY(InputWire frame, InputWire::open(places, "vsync"));
  SYMRIG_TRY(InputWire plane, InputWire::open(places, "in_a"));
  return std::unique_ptr<PlaneWatch>(new PlaneWatch(std::move(screen), placement, std::move(frame),
                                                    std::move(plane), std::move(controller), stage));
}

void PlaneWatch::run() {
  if (auto first = set_priority(kScreenPriority); !first) return stage_.stop(first.error());
  while (!stage_.stopped()) follow();
}

void PlaneWatch::follow() {
  const auto refresh = screen_.wait_refresh();
  if (!refresh) {  // no mode is set yet, or no longer
    last_.reset();
    std::this_thread::sleep_for(kScreenIsOff);
    return;
  }
  ++refreshes_;
  const auto before = std::exchange(last_, *refresh);
  if (!before || refresh->number <= before->number) return;
  const auto passed = static_cast<std::int64_t>(refresh->number - before->number);
  missed_ += static_cast<std::uint64_t>(passed) - 1;
  show(*refresh, (refresh->begin - before->begin) / passed);
}

/// The picture that is scanned out from this refresh on gives the planes of the next one.
void PlaneWatch::show(const Refresh& refresh, Nanoseconds period) {
  const auto sequence = controller_();
  const ScanoutPixels* const pixels = screen_.scanned_out();
  if (!sequence || pixels == nullptr) return;
  const auto words = cell_words(*pixels, placement_);
  if (steady_now() - refresh.begin > kReadIn) {
    ++missed_;
    return;
  }
  const Nanoseconds start = refresh.begin + period + kAfterRefresh;
  stage_.show(light_of_planes(words, placement_.grid, *sequence, start));
  const auto edges = edges_of_refresh(*sequence, start);
  const std::scoped_lock lock(mutex_);
  edges_.insert(edges_.end(), edges.begin(), edges.end());
  changed_.notify_all();
}

/// Takes all edges that are there at once. A lock for each would wait for the reader's thread, which others
/// may interrupt.
std::optional<TriggerEdge> PlaneWatch::next_edge() {
  if (taken_.empty()) {
    std::unique_lock lock(mutex_);
    if (edges_.empty()) changed_.wait_for(lock, kStopLatency);
    taken_.swap(edges_);
  }
  if (taken_.empty()) return std::nullopt;
  const TriggerEdge edge = taken_.front();
  taken_.pop_front();
  return edge;
}

void PlaneWatch::run_triggers() {
  if (auto first = set_priority(kTriggerPriority); !first) return stage_.stop(first.error());
  while (!stage_.stopped())
    if (const auto edge = next_edge())
      if (auto made = make(*edge); !made) stage_.stop(made.error());
}

Result<void> PlaneWatch::make(const TriggerEdge& edge) {
  sleep_until(edge.at - (edge.high ? kAwake : Nanoseconds{0}));
  while (steady_now() < edge.at) {
  }
  const InputWire& wire = edge.line == TriggerEdge::Line::frame ? frame_ : plane_;
  SYMRIG_TRY(const Moment made, wire.pull(edge.high));
  if (edge.high) latest_ = std::max(latest_, made.time + made.doubt - edge.at);
  return {};
}

}  // namespace symrig::bench_vm
