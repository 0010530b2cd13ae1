// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

namespace symrig {

/// How much memory the process may use, and where data go that do not fit.
struct MemoryBudget {
  std::int64_t bytes = 0;
  std::int64_t unpaged = 0;      ///< what the process needs besides paged memory
  std::filesystem::path folder;  ///< of scratch files, which have no names: nothing is left of them
};

/// While it lives, the budget holds for all PagedMemory of the process. What exceeds it is in scratch files,
/// mapped into memory. A thread watches the memory that the process occupies, and gives pages of these files
/// back before it exceeds the budget. Only one may live at a time: a second one changes nothing.
///
/// Only time depends on a budget, never a result. Memory that is not paged must fit by itself.
class MemoryScope {
 public:
  explicit MemoryScope(const MemoryBudget& budget);
  MemoryScope(const MemoryScope&) = delete;
  MemoryScope& operator=(const MemoryScope&) = delete;
  ~MemoryScope();

  /// Bytes in scratch files now.
  static std::int64_t scratch_bytes();

 private:
  class Watch;
  std::unique_ptr<Watch> watch_;
};

/// A scratch file cannot grow: the disk is full, or there is no such folder.
class NoScratchSpace : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Bytes that may be in a scratch file. Growing copies none of them.
class PagedMemory {
 public:
  PagedMemory() = default;
  PagedMemory(PagedMemory&& other) noexcept;
  PagedMemory& operator=(PagedMemory&& other) noexcept;
  PagedMemory(const PagedMemory&) = delete;
  PagedMemory& operator=(const PagedMemory&) = delete;
  ~PagedMemory();

  void* data() { return data_; }
  const void* data() const { return data_; }
  std::size_t capacity() const { return capacity_; }

  /// At least so many bytes.  Throws NoScratchSpace, std::bad_alloc.
  void reserve(std::size_t bytes);
  /// The same with room for more, for those who add a little each time.
  void grow(std::size_t bytes);

 private:
  /// Where the bytes are.
  enum class Place : std::uint8_t { heap, pages, file };
  void move_to_file(std::size_t capacity, const std::filesystem::path& folder);
  void grow_file(std::size_t capacity);
  void grow_heap(std::size_t capacity);
  void grow_pages(std::size_t capacity);
  void release();
  void swap(PagedMemory& other) noexcept;

  void* data_ = nullptr;
  std::size_t capacity_ = 0;
  Place place_ = Place::heap;
  int file_ = -1;
};

}  // namespace symrig
