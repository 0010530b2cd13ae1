// SPDX-License-Identifier: Apache-2.0
#include "camera/v4l2/video_system.hpp"
#include "symrig/base/files.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace symrig::camera {
namespace {

namespace fs = std::filesystem;

class LinuxNode final : public VideoNode {
 public:
  LinuxNode(Fd video, Fd wake) : video_(std::move(video)), wake_(std::move(wake)) {}

  int control(unsigned long request, void* argument) override {
    return ::ioctl(video_.get(), request, argument) < 0 ? errno : 0;
  }

  int map(std::size_t length, std::int64_t offset, std::span<const std::byte>& memory) override {
    // Nothing here writes to it, but drivers may demand both rights [Linux media, mmap()].
    void* const start = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, video_.get(), offset);
    if (start == MAP_FAILED) return errno;
    memory = {static_cast<const std::byte*>(start), length};
    return 0;
  }

  void unmap(std::span<const std::byte> memory) override {
    ::munmap(const_cast<std::byte*>(memory.data()),
             memory.size());  // NOLINT(cppcoreguidelines-pro-type-const-cast)
  }

  Wake wait(Nanoseconds patience) override {
    std::array<pollfd, 2> files{{{wake_.get(), POLLIN, 0}, {video_.get(), POLLIN, 0}}};
    const std::int64_t ms =
        std::clamp<std::int64_t>(patience.count() / 1'000'000, 0, std::numeric_limits<int>::max());
    if (::poll(files.data(), files.size(), static_cast<int>(ms)) <= 0) return Wake::nothing;
    if (files[0].revents != 0) {
      std::uint64_t calls = 0;
      // A failed read needs no action: the counter was zero.
      [[maybe_unused]] const auto got = ::read(wake_.get(), &calls, sizeof calls);
      return Wake::interrupted;
    }
    if ((files[1].revents & POLLIN) != 0) return Wake::frame;
    return files[1].revents != 0 ? Wake::hangup : Wake::nothing;
  }

  void interrupt() override {
    const std::uint64_t once = 1;
    [[maybe_unused]] const auto put = ::write(wake_.get(), &once, sizeof once);
  }

  Nanoseconds now() override {
    timespec t{};
    ::clock_gettime(CLOCK_MONOTONIC, &t);
    return std::chrono::seconds(t.tv_sec) + Nanoseconds(t.tv_nsec);
  }

 private:
  Fd video_, wake_;
};

/// The number at the end of "video12". -1: the name has another form.
int node_number(std::string_view name) {
  constexpr std::string_view kBegin = "video";
  if (!name.starts_with(kBegin)) return -1;
  int number = -1;
  const char* const end = name.data() + name.size();
  const auto parsed = std::from_chars(name.data() + kBegin.size(), end, number);
  return parsed.ec == std::errc() && parsed.ptr == end ? number : -1;
}

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

class LinuxVideo final : public VideoSystem {
 public:
  std::vector<std::string> paths() override {
    std::vector<std::pair<int, std::string>> found;
    std::error_code failed;
    for (const auto& entry : fs::directory_iterator("/dev", failed))
      if (const int number = node_number(entry.path().filename().string()); number >= 0)
        found.emplace_back(number, entry.path().string());
    std::sort(found.begin(), found.end());
    std::vector<std::string> paths;
    paths.reserve(found.size());
    for (auto& [number, path] : found) paths.push_back(std::move(path));
    return paths;
  }

  /// The "serial" of the node's device or of its nearest parent that has one. USB devices have it in sysfs.
  std::string serial(const std::string& path) override {
    std::error_code failed;
    const fs::path node = fs::canonical(path, failed).filename();
    fs::path folder = fs::canonical(fs::path("/sys/class/video4linux") / node / "device", failed);
    if (failed) return {};
    for (; folder.has_relative_path(); folder = folder.parent_path()) {
      std::string line = first_line(folder / "serial");
      if (!line.empty()) return line;
      if (fs::exists(folder / "idVendor", failed)) return {};  // USB, no serial number; parents are hubs
    }
    return {};
  }

  int open(const std::string& path, std::unique_ptr<VideoNode>& node) override {
    Fd video(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    if (!video) return errno;
    Fd wake(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
    if (!wake) return errno;
    node = std::make_unique<LinuxNode>(std::move(video), std::move(wake));
    return 0;
  }
};

}  // namespace

VideoSystem& linux_video() {
  static LinuxVideo system;
  return system;
}

}  // namespace symrig::camera
