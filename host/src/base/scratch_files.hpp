// SPDX-License-Identifier: Apache-2.0
// What all paged memory of the process shares: the budget, and the mapped scratch files.
#pragma once

#include "symrig/base/memory.hpp"

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

namespace symrig::base {

/// A file without a name, mapped into memory.
struct ScratchFile {
  int file = -1;
  void* data = nullptr;
  std::size_t bytes = 0;
};

class ScratchFiles {
 public:
  std::mutex mutex;                     ///< of budget and mapped
  std::condition_variable changed;      ///< the first file came, or the scope ends
  std::optional<MemoryBudget> budget;   ///< while a MemoryScope lives
  std::map<void*, std::size_t> mapped;  ///< all scratch files, and their bytes
  std::atomic<std::int64_t> in_memory = 0;
  std::atomic<std::int64_t> in_files = 0;  ///< without the spare ones

  /// The folder for scratch files if `more` bytes do not fit into memory. Half of what is left for paged
  /// memory is for pages of the files.
  std::optional<std::filesystem::path> folder_for(std::size_t more);

  /// A file of at least so many bytes, whatever they are. Throws NoScratchSpace, std::bad_alloc.
  ScratchFile get(std::size_t bytes, const std::filesystem::path& folder);
  /// Makes it larger. Its bytes stay. Throws as get(); then it is as it was.
  void grow(ScratchFile& one, std::size_t bytes);
  /// It is no longer needed. It is kept for the next get(): a new file takes blocks of the disk, and its
  /// pages must be zeroed.
  void put_back(const ScratchFile& one);
  /// Files that nobody needs go: the scope has ended, or the disk is full. False if there were none.
  bool drop_spares();

 private:
  std::optional<ScratchFile> take_spare(std::size_t bytes);
  void enlist(const ScratchFile& one);
  void strike(const ScratchFile& one);
  void drop(const ScratchFile& one);

  std::vector<ScratchFile> spares_;  // guarded by mutex
  std::size_t spare_bytes_ = 0;
};

ScratchFiles& scratch_files();

}  // namespace symrig::base
