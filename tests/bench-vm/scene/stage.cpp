// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/stage.hpp"

#include "symrig/base/time.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace symrig::bench_vm {

void Stage::show(Nanoseconds since, const Picture& picture, std::size_t screen) {
  const std::scoped_lock lock(mutex_);
  if (screens_.change(screen, since, picture)) changed_.notify_all();
}

void Stage::show(const std::vector<std::pair<Nanoseconds, Picture>>& changes) {
  const std::scoped_lock lock(mutex_);
  bool changed = false;
  for (const auto& [since, picture] : changes) changed = screens_.change(0, since, picture) || changed;
  if (changed) changed_.notify_all();
}

void Stage::exposed(const Exposure& exposure) {
  const std::scoped_lock lock(mutex_);
  exposures_.push_back(exposure);
  ++exposed_;
  changed_.notify_all();
}

void Stage::plug_camera(bool in) {
  const std::scoped_lock lock(mutex_);
  plugged_ = in;
  changed_.notify_all();
}

void Stage::stop(std::optional<Error> failure) {
  const std::scoped_lock lock(mutex_);
  if (!failure_) failure_ = std::move(failure);
  stopped_ = true;
  changed_.notify_all();
}

std::optional<Error> Stage::failure() {
  const std::scoped_lock lock(mutex_);
  return failure_;
}

ScreenTimeline::Lit Stage::newest() {
  const std::scoped_lock lock(mutex_);
  return screens_.newest();
}

std::optional<Exposure> Stage::next_exposure(Nanoseconds age, Nanoseconds until) {
  std::unique_lock lock(mutex_);
  const Nanoseconds now = steady_now();
  if (exposures_.empty()) {
    if (now < until && !stopped_) changed_.wait_for(lock, until - now);
    return std::nullopt;
  }
  const Nanoseconds ripe = exposures_.front().end.time + age;
  if (now < ripe) {
    const Nanoseconds wake = std::min(ripe, until);
    if (now < wake && !stopped_) changed_.wait_for(lock, wake - now);
    return std::nullopt;
  }
  const Exposure next = exposures_.front();
  exposures_.pop_front();
  return next;
}

std::vector<ScreenTimeline::Lit> Stage::lit_during(const Exposure& exposure) {
  const std::scoped_lock lock(mutex_);
  screens_.forget_before(exposure.begin.time);
  return screens_.during(exposure.begin.time, exposure.end.time);
}

}  // namespace symrig::bench_vm
