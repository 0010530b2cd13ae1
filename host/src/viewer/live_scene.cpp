// SPDX-License-Identifier: Apache-2.0
#include "symrig/viewer/live.hpp"

#include <utility>

// What a part replaces is destroyed after the lock is released.
namespace symrig {

void LiveScene::show(LiveStatus status) {
  auto fresh = std::make_shared<const LiveStatus>(std::move(status));
  const std::lock_guard lock(mutex_);
  now_.status.swap(fresh);
}

void LiveScene::show(LivePhotograph last) {
  auto fresh = std::make_shared<const LivePhotograph>(std::move(last));
  const std::lock_guard lock(mutex_);
  now_.last.swap(fresh);
  ++now_.photographs;
}

void LiveScene::show(const std::optional<LiveLevel>& level, MakeTensor make) {
  auto fresh = std::make_shared<const MakeTensor>(std::move(make));
  std::vector<LiveLevel> all = *now().levels;
  if (level) all.push_back(*level);
  auto levels = std::make_shared<const std::vector<LiveLevel>>(std::move(all));
  const std::lock_guard lock(mutex_);
  now_.make.swap(fresh);
  now_.levels.swap(levels);
  ++now_.tensors;
}

void LiveScene::complete(StoredScene scene, Truth truth) {
  auto whole = std::make_shared<const StoredScene>(std::move(scene));
  auto known = std::make_shared<const Truth>(std::move(truth));
  std::shared_ptr<const MakeTensor> last;
  const std::lock_guard lock(mutex_);
  now_.scene.swap(whole);
  now_.truth.swap(known);
  now_.make.swap(last);
}

void LiveScene::fail(std::string reason) {
  auto why = std::make_shared<const std::string>(std::move(reason));
  const std::lock_guard lock(mutex_);
  now_.failure.swap(why);
}

void LiveScene::asked(bool told) const {
  last_asked_ = steady_now().count();
  if (told) told_ = true;
}

bool LiveScene::watched_within(Nanoseconds time) const {
  const std::int64_t last = last_asked_;
  return last != kNever && steady_now().count() - last <= time.count();
}

LiveScene::Now LiveScene::now() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

}  // namespace symrig
