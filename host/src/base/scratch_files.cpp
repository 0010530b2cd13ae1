// SPDX-License-Identifier: Apache-2.0

#include "base/scratch_files.hpp"

#include "symrig/base/memory.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <new>
#include <string>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

namespace symrig::base {
namespace {

NoScratchSpace no_space(const std::filesystem::path& folder, std::size_t bytes, int cause) {
  return NoScratchSpace(folder.string() + ": a scratch file of " +
                        std::to_string((bytes + (std::size_t{1} << 20) - 1) >> 20) +
                        " MiB cannot be written (" + std::strerror(cause) + ")");
}

/// A file without a name.
int new_file(const std::filesystem::path& folder, std::size_t bytes) {
  const std::filesystem::path at = folder.empty() ? "." : folder;
  const int file = ::open(at.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0) return file;
  // Some file systems cannot do that.
  std::string name = (at / ".symrig-scratch-XXXXXX").string();
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named < 0) throw no_space(at, bytes, errno);
  ::unlink(name.c_str());
  return named;
}

/// Blocks of the disk are taken now: a page that finds none later would end the process.
void take_blocks(int file, std::size_t bytes, const std::filesystem::path& folder) {
  const int cause = ::posix_fallocate(file, 0, static_cast<::off_t>(bytes));
  if (cause != 0) throw no_space(folder, bytes, cause);
}

ScratchFile make(std::size_t bytes, const std::filesystem::path& folder) {
  ScratchFile one{new_file(folder, bytes), nullptr, bytes};
  try {
    take_blocks(one.file, bytes, folder);
    one.data = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, one.file, 0);
    if (one.data == MAP_FAILED) throw std::bad_alloc();
  } catch (...) {
    ::close(one.file);
    throw;
  }
  return one;
}

}  // namespace

ScratchFiles& scratch_files() {
  static auto* const all = new ScratchFiles;  // paged memory may outlive every other static object
  return *all;
}

std::optional<std::filesystem::path> ScratchFiles::folder_for(std::size_t more) {
  const std::scoped_lock lock(mutex);
  if (!budget) return std::nullopt;
  const auto wanted = static_cast<std::int64_t>(more);
  // As planned, and as it is: freed memory that the heap keeps counts too.
  const bool planned =
      in_memory + wanted <= std::max<std::int64_t>(budget->bytes - budget->unpaged, 0) * 2 / 5;
  if (planned && anonymous_memory() + wanted <= budget->bytes / 3 * 2) return std::nullopt;
  return budget->folder;
}

ScratchFile ScratchFiles::get(std::size_t bytes, const std::filesystem::path& folder) {
  if (const auto spare = take_spare(bytes)) return *spare;
  const ScratchFile one = [&] {
    try {
      return make(bytes, folder);
    } catch (const NoScratchSpace&) {
      if (!drop_spares()) throw;
    }
    return make(bytes, folder);
  }();
  enlist(one);
  return one;
}

void ScratchFiles::grow(ScratchFile& one, std::size_t bytes) {
  take_blocks(one.file, bytes, "the scratch folder");  // whatever its name was when the file was made
  const std::scoped_lock lock(mutex);  // the watch must not give back pages where something else is
  void* const moved = ::mremap(one.data, one.bytes, bytes, MREMAP_MAYMOVE);
  if (moved == MAP_FAILED) throw std::bad_alloc();
  auto entry = mapped.extract(one.data);
  entry.key() = moved;
  entry.mapped() = bytes;
  mapped.insert(std::move(entry));
  in_files += static_cast<std::int64_t>(bytes - one.bytes);
  one.data = moved;
  one.bytes = bytes;
}

void ScratchFiles::put_back(const ScratchFile& one) {
  {
    const std::scoped_lock lock(mutex);
    in_files -= static_cast<std::int64_t>(one.bytes);
    const std::size_t most = budget ? static_cast<std::size_t>(budget->bytes) : 0;
    if (spare_bytes_ + one.bytes <= most) {
      spares_.push_back(one);
      spare_bytes_ += one.bytes;
      return;
    }
  }
  drop(one);
}

bool ScratchFiles::drop_spares() {
  std::vector<ScratchFile> all;
  {
    const std::scoped_lock lock(mutex);
    std::swap(all, spares_);
    spare_bytes_ = 0;
  }
  for (const ScratchFile& one : all) drop(one);
  return !all.empty();
}

/// The smallest that is large enough, unless most of it would be wasted.
std::optional<ScratchFile> ScratchFiles::take_spare(std::size_t bytes) {
  const std::scoped_lock lock(mutex);
  auto best = spares_.end();
  for (auto one = spares_.begin(); one != spares_.end(); ++one)
    if (one->bytes >= bytes && one->bytes <= 2 * bytes && (best == spares_.end() || one->bytes < best->bytes))
      best = one;
  if (best == spares_.end()) return std::nullopt;
  const ScratchFile found = *best;
  spares_.erase(best);
  spare_bytes_ -= found.bytes;
  in_files += static_cast<std::int64_t>(found.bytes);
  return found;
}

void ScratchFiles::enlist(const ScratchFile& one) {
  const std::scoped_lock lock(mutex);
  mapped[one.data] = one.bytes;
  spares_.reserve(mapped.size());  // put_back() is called by destructors, so it must not fail
  in_files += static_cast<std::int64_t>(one.bytes);
  changed.notify_all();
}

void ScratchFiles::strike(const ScratchFile& one) {
  const std::scoped_lock lock(mutex);
  mapped.erase(one.data);
}

void ScratchFiles::drop(const ScratchFile& one) {
  strike(one);
  ::munmap(one.data, one.bytes);
  ::close(one.file);
}

}  // namespace symrig::base

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
