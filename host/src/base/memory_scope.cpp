// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/memory_scope.hpp"

#include "base/scratch_files.hpp"
#include "symrig/base/memory.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

#include <malloc.h>
#include <sys/mman.h>

namespace symrig {

/// Gives pages of scratch files back when the process occupies too much. It sleeps while there are none.
class MemoryScope::Watch {
 public:
  explicit Watch(std::int64_t bytes) : bytes_(bytes), thread_([this] { run(); }) {}
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  ~Watch() {
    {
      const std::scoped_lock lock(files_.mutex);
      ended_ = true;
    }
    files_.changed.notify_all();
    thread_.join();
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kPause{2};
  static constexpr std::chrono::milliseconds kBetweenTrims{200};  // a trim goes through the whole heap

  void run() {
    std::unique_lock lock(files_.mutex);
    while (!ended_) {
      files_.changed.wait(lock, [this] { return ended_ || !files_.mapped.empty(); });
      if (resident_memory() > bytes_ - bytes_ / 24) give_back();
      files_.changed.wait_for(lock, kPause, [this] { return ended_; });
    }
  }

  /// Goes on behind the file that was given back last, until enough is free. Then the heap gives back what
  /// was freed and kept for later.
  void give_back() {
    const std::int64_t enough = bytes_ - bytes_ / 8;
    for (std::size_t k = 0; k < files_.mapped.size() && resident_memory() > enough; ++k) {
      auto next = files_.mapped.upper_bound(last_);
      if (next == files_.mapped.end()) next = files_.mapped.begin();
      last_ = next->first;
      ::madvise(next->first, next->second, MADV_DONTNEED);  // the file keeps what was written
    }
    if (resident_memory() <= bytes_ - bytes_ / 24 || Clock::now() < next_trim_) return;
    ::malloc_trim(0);
    next_trim_ = Clock::now() + kBetweenTrims;
  }

  base::ScratchFiles& files_ = base::scratch_files();
  std::int64_t bytes_;
  void* last_ = nullptr;
  Clock::time_point next_trim_{};
  bool ended_ = false;  // guarded by files_.mutex
  std::thread thread_;
};

MemoryScope::MemoryScope(const MemoryBudget& budget) {
  base::ScratchFiles& files = base::scratch_files();
  const std::scoped_lock lock(files.mutex);
  if (files.budget) return;
  files.budget = budget;
  watch_ = std::make_unique<Watch>(budget.bytes);
}

MemoryScope::~MemoryScope() {
  if (!watch_) return;
  watch_.reset();
  base::ScratchFiles& files = base::scratch_files();
  files.drop_spares();
  const std::scoped_lock lock(files.mutex);
  files.budget.reset();
}

std::int64_t MemoryScope::scratch_bytes() {
  return base::scratch_files().in_files;
}

}  // namespace symrig
