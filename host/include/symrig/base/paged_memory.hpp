// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <stdexcept>

namespace symrig {

namespace base {
struct ScratchFile;
}

/// A scratch file cannot grow: the disk is full, or there is no such folder. Or it cannot be read.
class NoScratchSpace : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Bytes that may be in a scratch file, while a MemoryScope (memory_scope.hpp) lives. Growing copies none of
/// them.
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
  bool in_file() const { return place_ == Place::file; }

  /// Copies bytes [first, first + count) of a scratch file, without mapping its pages.
  /// Throws NoScratchSpace.
  void read(std::size_t first, std::size_t count, void* to) const;

  /// At least so many bytes.  Throws NoScratchSpace, std::bad_alloc.
  void reserve(std::size_t bytes);
  /// The same with room for more, for those who add a little each time.
  void grow(std::size_t bytes);

 private:
  /// Where the bytes are.
  enum class Place : std::uint8_t { heap, pages, file };
  void move_to_file(std::size_t capacity, const std::filesystem::path& folder);
  void grow_file(std::size_t capacity);
  void become(const base::ScratchFile& file);
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
