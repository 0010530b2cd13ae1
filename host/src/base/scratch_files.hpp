// SPDX-License-Identifier: Apache-2.0
// What all paged memory of the process shares: the budget, and the mapped scratch files.
#pragma once

#include "symrig/base/memory_scope.hpp"

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>

namespace symrig::base {

struct ScratchFiles {
  std::mutex mutex;                     ///< of the three below
  std::condition_variable changed;      ///< the first file came, or the scope ends
  std::optional<MemoryBudget> budget;   ///< while a MemoryScope lives
  std::map<void*, std::size_t> mapped;  ///< scratch files, and their bytes
  std::atomic<std::int64_t> in_memory = 0;
  std::atomic<std::int64_t> in_files = 0;

  /// The folder for scratch files if `more` bytes do not fit into memory. A quarter of what is left for paged
  /// memory is for pages of the files.
  std::optional<std::filesystem::path> folder_for(std::size_t more);
  void enlist(void* data, std::size_t bytes);
  void strike(void* data);
};

ScratchFiles& scratch_files();

}  // namespace symrig::base
