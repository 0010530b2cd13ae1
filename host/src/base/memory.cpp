// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/memory.hpp"

#include "base/scratch_files.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include <fcntl.h>
#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;

/// The number in a file of one number; none if there is no file, or if it is "max".
std::optional<std::int64_t> number_in(const fs::path& path) {
  std::ifstream file(path);
  std::int64_t number = 0;
  if (file >> number) return number;
  return std::nullopt;
}

std::optional<std::int64_t> stated_by_system() {
  std::ifstream file("/proc/meminfo");
  for (std::string name; file >> name;) {
    std::int64_t kibibytes = 0;
    if (name == "MemAvailable:" && file >> kibibytes) return kibibytes << 10;
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return std::nullopt;
}

/// The least that one of the control groups (version 2) of this process has left, from its own upwards. File
/// pages in memory count as left: the system takes them back when they are needed.
std::optional<std::int64_t> left_by_groups() {
  std::ifstream file("/proc/self/cgroup");
  std::string line;
  while (std::getline(file, line) && !line.starts_with("0::")) continue;
  if (!line.starts_with("0::/")) return std::nullopt;
  std::optional<std::int64_t> least;
  const fs::path root = "/sys/fs/cgroup";
  for (fs::path group = fs::path(line.substr(4));; group = group.parent_path()) {
    const auto most = number_in(root / group / "memory.max");
    const auto used = number_in(root / group / "memory.current");
    if (most && used) {
      std::int64_t pages = 0;
      std::ifstream stat(root / group / "memory.stat");
      for (std::string name; stat >> name;) {
        std::int64_t bytes = 0;
        stat >> bytes;
        if (name == "inactive_file" || name == "active_file") pages += bytes;
      }
      const std::int64_t left = std::max<std::int64_t>(*most - *used + pages, 0);
      least = std::min(least.value_or(left), left);
    }
    if (group.empty()) return least;
  }
}

struct InMemory {
  std::int64_t all = 0, of_files = 0;
};

InMemory bytes_in_memory() {
  // Open as long as the program runs: it is read often.
  static const int file = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  std::array<char, 128> text{};
  if (::pread(file, text.data(), text.size() - 1, 0) <= 0) return {};
  char* next = nullptr;
  static_cast<void>(std::strtoll(text.data(), &next, 10));  // the size of the address space
  const std::int64_t page = ::sysconf(_SC_PAGESIZE);
  const std::int64_t all = std::strtoll(next, &next, 10) * page;
  return {all, std::strtoll(next, &next, 10) * page};
}

}  // namespace

std::int64_t available_memory() {
  constexpr std::int64_t kUnknown = std::int64_t{1} << 30;
  const auto system = stated_by_system();
  const auto groups = left_by_groups();
  if (!system && !groups) return kUnknown;
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
  return std::min(system.value_or(kMost), groups.value_or(kMost));
}

std::int64_t usual_memory() {
  static const std::int64_t usual = available_memory() / 2;
  return usual;
}

std::int64_t resident_memory() {
  return bytes_in_memory().all;
}

std::int64_t anonymous_memory() {
  const InMemory now = bytes_in_memory();
  return now.all - now.of_files;
}

void give_back_freed_memory() {
  constexpr std::size_t kMuch = std::size_t{64} << 20;
  if (::mallinfo2().fordblks >= kMuch) ::malloc_trim(0);
}

namespace {

constexpr std::size_t kLeastFile = std::size_t{256} << 10;  ///< smaller memory is never in a file
/// Smaller memory comes from the heap, which keeps what is freed. New pages take time.
constexpr std::size_t kLeastPages = std::size_t{32} << 20;
constexpr std::size_t kPage = std::size_t{64} << 10;  ///< a multiple of every page size

std::size_t rounded(std::size_t bytes) {
  return (bytes + kPage - 1) / kPage * kPage;
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
  std::swap(storage_, other.storage_);
  std::swap(file_, other.file_);
}

void PagedMemory::release() {
  if (storage_ != Storage::file) base::scratch_files().in_memory -= static_cast<std::int64_t>(capacity_);
  if (storage_ == Storage::heap) std::free(data_);
  if (storage_ == Storage::pages) ::munmap(data_, capacity_);
  if (storage_ == Storage::file) base::scratch_files().put_back({file_, data_, capacity_});
  data_ = nullptr;
  capacity_ = 0;
  storage_ = Storage::heap;
  file_ = -1;
}

void PagedMemory::grow(std::size_t bytes) {
  // Pages cost nothing before they are used; blocks of a disk do.
  const std::size_t more = storage_ == Storage::file ? bytes / 8 : bytes / 2;
  reserve(bytes + more);
}

void PagedMemory::reserve(std::size_t bytes) {
  if (bytes <= capacity_) return;
  const std::size_t capacity = rounded(bytes);
  if (storage_ == Storage::file) return grow_file(capacity);
  if (bytes >= kLeastFile)
    if (const auto folder = base::scratch_files().folder_for(capacity - capacity_))
      return move_to_file(capacity, *folder);
  if (storage_ == Storage::heap && bytes < kLeastPages) return grow_heap(bytes);
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
  if (storage_ == Storage::pages) {
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
  storage_ = Storage::pages;
  base::scratch_files().in_memory += static_cast<std::int64_t>(capacity);
}

void PagedMemory::move_to_file(std::size_t capacity, const std::filesystem::path& folder) {
  const base::ScratchFile to = base::scratch_files().get(capacity, folder);
  if (capacity_ > 0) std::memcpy(to.data, data_, capacity_);
  release();
  become(to);
}

void PagedMemory::read(std::size_t first, std::size_t count, void* to) const {
  for (std::size_t done = 0; done < count;) {
    const ::ssize_t got =
        ::pread(file_, static_cast<char*>(to) + done, count - done, static_cast<::off_t>(first + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) throw NoScratchSpace("a scratch file cannot be read: it was cut, or its disk fails");
    done += static_cast<std::size_t>(got);
  }
}

void PagedMemory::grow_file(std::size_t capacity) {
  base::ScratchFile one{file_, data_, capacity_};
  base::scratch_files().grow(one, capacity);
  become(one);
}

void PagedMemory::become(const base::ScratchFile& file) {
  data_ = file.data;
  capacity_ = file.bytes;
  file_ = file.file;
  storage_ = Storage::file;
}

}  // namespace symrig
