// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/paged_memory.hpp"

#include "base/scratch_files.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace symrig {
namespace {

constexpr std::size_t kLeastFile = std::size_t{256} << 10;  ///< smaller memory is never in a file
/// Smaller memory comes from the heap, which keeps what is freed. New pages take time.
constexpr std::size_t kLeastPages = std::size_t{32} << 20;
constexpr std::size_t kPage = std::size_t{64} << 10;  ///< a multiple of every page size

std::size_t rounded(std::size_t bytes) {
  return (bytes + kPage - 1) / kPage * kPage;
}

NoScratchSpace no_space(const std::filesystem::path& folder, std::size_t bytes, int cause) {
  return NoScratchSpace(folder.string() + ": a scratch file of " +
                        std::to_string((bytes + (std::size_t{1} << 20) - 1) >> 20) +
                        " MiB cannot be written (" + std::strerror(cause) + ")");
}

/// A file without a name.
int new_file(const std::filesystem::path& folder) {
  const std::filesystem::path at = folder.empty() ? "." : folder;
  const int file = ::open(at.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0) return file;
  // Some file systems cannot do that.
  std::string name = (at / ".symrig-scratch-XXXXXX").string();
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named < 0) throw no_space(at, 0, errno);
  ::unlink(name.c_str());
  return named;
}

void write_all(int file, const char* from, std::size_t bytes, const std::filesystem::path& folder) {
  for (std::size_t done = 0; done < bytes;) {
    const ::ssize_t count = ::pwrite(file, from + done, bytes - done, static_cast<::off_t>(done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw no_space(folder, bytes, errno);
    done += static_cast<std::size_t>(count);
  }
}

/// Blocks of the disk are taken now: a page that finds none later would end the process.
void take_blocks(int file, std::size_t bytes, const std::filesystem::path& folder) {
  const int cause = ::posix_fallocate(file, 0, static_cast<::off_t>(bytes));
  if (cause != 0) throw no_space(folder, bytes, cause);
}

void* mapped(int file, std::size_t bytes) {
  void* const data = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (data == MAP_FAILED) throw std::bad_alloc();
  return data;
}

void unmap(void* data, std::size_t bytes) {
  base::scratch_files().strike(data);
  ::munmap(data, bytes);
}

}  // namespace

PagedMemory::PagedMemory(PagedMemory&& other) noexcept {
  swap(other);
}

PagedMemory& PagedMemory::operator=(PagedMemory&& other) noexcept {
  if (this != &other) {
    release();
    swap(other);
  }
  return *this;
}

PagedMemory::~PagedMemory() {
  release();
}

void PagedMemory::swap(PagedMemory& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(capacity_, other.capacity_);
  std::swap(place_, other.place_);
  std::swap(file_, other.file_);
}

void PagedMemory::release() {
  if (place_ != Place::file) base::scratch_files().in_memory -= static_cast<std::int64_t>(capacity_);
  if (place_ == Place::heap) std::free(data_);
  if (place_ == Place::pages) ::munmap(data_, capacity_);
  if (place_ == Place::file) {
    unmap(data_, capacity_);
    ::close(file_);
  }
  data_ = nullptr;
  capacity_ = 0;
  place_ = Place::heap;
  file_ = -1;
}

void PagedMemory::grow(std::size_t bytes) {
  // Pages cost nothing before they are used; blocks of a disk do.
  const std::size_t more = place_ == Place::file ? bytes / 8 : bytes / 2;
  reserve(bytes + more);
}

void PagedMemory::reserve(std::size_t bytes) {
  if (bytes <= capacity_) return;
  const std::size_t capacity = rounded(bytes);
  if (place_ == Place::file) return grow_file(capacity);
  if (bytes >= kLeastFile)
    if (const auto folder = base::scratch_files().folder_for(capacity - capacity_))
      return move_to_file(capacity, *folder);
  if (place_ == Place::heap && bytes < kLeastPages) return grow_heap(bytes);
  grow_pages(capacity);
}

void PagedMemory::grow_heap(std::size_t capacity) {
  void* const data = std::realloc(data_, capacity);
  if (data == nullptr) throw std::bad_alloc();
  base::scratch_files().in_memory += static_cast<std::int64_t>(capacity - capacity_);
  data_ = data;
  capacity_ = capacity;
}

void PagedMemory::grow_pages(std::size_t capacity) {
  if (place_ == Place::pages) {
    void* const moved = ::mremap(data_, capacity_, capacity, MREMAP_MAYMOVE);
    if (moved == MAP_FAILED) throw std::bad_alloc();
    base::scratch_files().in_memory += static_cast<std::int64_t>(capacity - capacity_);
    data_ = moved;
    capacity_ = capacity;
    return;
  }
  void* const data = ::mmap(nullptr, capacity, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (data == MAP_FAILED) throw std::bad_alloc();
  if (capacity_ > 0) std::memcpy(data, data_, capacity_);
  release();
  data_ = data;
  capacity_ = capacity;
  place_ = Place::pages;
  base::scratch_files().in_memory += static_cast<std::int64_t>(capacity);
}

void PagedMemory::move_to_file(std::size_t capacity, const std::filesystem::path& folder) {
  const int file = new_file(folder);
  void* data = nullptr;
  try {
    take_blocks(file, capacity, folder);
    write_all(file, static_cast<const char*>(data_), capacity_, folder);
    data = mapped(file, capacity);
  } catch (...) {
    ::close(file);
    throw;
  }
  release();
  base::scratch_files().enlist(data, capacity);
  data_ = data;
  capacity_ = capacity;
  place_ = Place::file;
  file_ = file;
}

void PagedMemory::grow_file(std::size_t capacity) {
  take_blocks(file_, capacity, "the scratch folder");  // whatever its name was when the file was made
  void* const data = mapped(file_, capacity);
  unmap(data_, capacity_);
  base::scratch_files().enlist(data, capacity);
  data_ = data;
  capacity_ = capacity;
}

}  // namespace symrig
