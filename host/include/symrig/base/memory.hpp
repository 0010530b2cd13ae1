// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

namespace symrig {

/// Bytes of memory that programs can still get: what the system states as available (/proc/meminfo), and what
/// the control groups of this process have left. 1 GiB if neither is known.
std::int64_t available_memory();

/// What a job may use if nobody says otherwise: half of available_memory(), as it was when the process first
/// asked. So the same file is treated the same way all the time.
std::int64_t usual_memory();

/// Bytes that the process has in memory now.
std::int64_t resident_memory();

/// Those that belong to no file: they can only leave memory when they are freed.
std::int64_t anonymous_memory();

/// Gives memory back to the system that was freed here, if it is much. malloc keeps it for later, also
/// between other memory where nothing fits. Pages that are used again then cost time, so this is for the end
/// of a stage.
void give_back_freed_memory();

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

namespace base {
struct ScratchFile;
}

/// A scratch file cannot grow: the disk is full, or there is no such folder. Or it cannot be read.
class NoScratchSpace : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Bytes that may be in a scratch file, while a MemoryScope lives. Growing copies none of
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
  bool in_file() const { return storage_ == Storage::file; }

  /// Copies bytes [first, first + count) of a scratch file, without mapping its pages.
  /// Throws NoScratchSpace.
  void read(std::size_t first, std::size_t count, void* to) const;

  /// At least so many bytes.  Throws NoScratchSpace, std::bad_alloc.
  void reserve(std::size_t bytes);
  /// The same with room for more, for those who add a little each time.
  void grow(std::size_t bytes);

 private:
  /// Where the bytes are.
  enum class Storage : std::uint8_t { heap, pages, file };
  void move_to_file(std::size_t capacity, const std::filesystem::path& folder);
  void grow_file(std::size_t capacity);
  void become(const base::ScratchFile& file);
  void grow_heap(std::size_t capacity);
  void grow_pages(std::size_t capacity);
  void release();
  void swap(PagedMemory& other) noexcept;

  void* data_ = nullptr;
  std::size_t capacity_ = 0;
  Storage storage_ = Storage::heap;
  int file_ = -1;
};

inline constexpr const char* kMoreMemory = "use a smaller grid or a machine with more memory";

/// Turns exceptions of a long job into errors, so that its caller can still report what is kept.
template <class Work>
auto guarded(Work&& work) -> decltype(work()) {
  try {
    return std::forward<Work>(work)();
  } catch (const NoScratchSpace& error) {
    return Error{ErrorCode::io, error.what(), "free space on that disk, or allow more memory"};
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::limit, "out of memory", kMoreMemory};
  } catch (const std::exception& error) {
    return Error{ErrorCode::limit, std::string("internal fault: ") + error.what(), ""};
  }
}

}  // namespace symrig
