// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/memory.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>

#include <fcntl.h>
#include <malloc.h>
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

}  // namespace symrig
