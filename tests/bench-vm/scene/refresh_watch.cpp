// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/watchers.hpp"
#include "symrig/base/time.hpp"

#include <chrono>
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

}  // namespace symrig::bench_vm
