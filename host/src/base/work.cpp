// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/work.hpp"

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>
#include <utility>

namespace symrig {

struct Work::State {
  explicit State(Progress given) : progress(std::move(given)) {}

  /// A callback that computes may come back here: its thread takes tasks of ours while it waits.
  bool call() {
    if (stop.load(std::memory_order_relaxed)) return false;
    if (calling) return true;
    calling = true;
    ProgressEvent event = last;
    event.stage = stage;
    told = operations.load(std::memory_order_relaxed);
    event.steps = {told / kStep, expected > 0 ? std::max(expected, told) / kStep : 0};
    const bool go_on = progress(event);
    if (!go_on) stop.store(true, std::memory_order_relaxed);
    calling = false;
    return go_on;
  }
  bool by_owner() const { return std::this_thread::get_id() == owner; }
  void start(std::string_view name, std::int64_t wanted) {
    stage = name;
    expected = wanted;
    operations.store(0, std::memory_order_relaxed);
    told = 0;
  }

  const Progress progress;
  const std::thread::id owner = std::this_thread::get_id();
  std::atomic<std::int64_t> operations{0};  ///< of the stage
  std::atomic<bool> stop{false};
  // Only the owner uses these.
  std::string stage;
  ProgressEvent last;  ///< its photographs
  std::int64_t expected = 0, told = 0;
  bool calling = false;
};

Work::Work(Progress progress) {
  if (progress) state_ = std::make_shared<State>(std::move(progress));
}

bool Work::tell(ProgressEvent event) const {
  if (!state_) return true;
  if (event.stage != state_->stage) state_->start(event.stage, 0);
  state_->last = event;
  return state_->call();
}

void Work::begin(std::string_view stage, std::int64_t operations, std::optional<std::int64_t> taken) const {
  if (!state_) return;
  state_->start(stage, operations);
  const std::int64_t done = taken.value_or(state_->last.done);
  state_->last = {.stage = {}, .done = done, .expected = done, .later = kNoneToCome, .computing = true};
  if (!state_->call()) throw Stopped{};
}

void Work::add(std::int64_t operations) const {
  if (!state_) return;
  const std::int64_t done = operations + state_->operations.fetch_add(operations, std::memory_order_relaxed);
  if (state_->by_owner() && done - state_->told >= kStep) look();
  if (stopped()) throw Stopped{};
}

void Work::look() const {
  if (state_ && !state_->call()) throw Stopped{};
}

bool Work::stopped() const {
  return state_ && state_->stop.load(std::memory_order_relaxed);
}

void Work::count(std::int64_t operations) const noexcept {
  if (state_) state_->operations.fetch_add(operations, std::memory_order_relaxed);
}

Error Work::stop_error() const {
  std::string what =
      "capture stopped after " + std::to_string(state_ ? state_->last.done : 0) + " photographs";
  if (state_ && state_->last.computing) what += ", while it computed (" + state_->stage + ")";
  return {ErrorCode::interrupted, std::move(what), "run it again"};
}

}  // namespace symrig
