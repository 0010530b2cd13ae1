// SPDX-License-Identifier: Apache-2.0

#include "camera/v4l2/open_node.hpp"

#include "symrig/base/files.hpp"
#include "symrig/camera/frame_format.hpp"
#include "symrig/camera/internal/video_system.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
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

namespace {

/// The text of a fixed-length field, which may lack the final zero.
template <std::size_t N>
std::string text(const std::uint8_t (&field)[N]) {
  const auto* const end = std::find(field, field + N, std::uint8_t{0});
  return {field, end};
}

Error cannot_open(const std::string& path, int reason) {
  switch (reason) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return {ErrorCode::device_lost, fmt::format("camera {} is missing ({})", path, std::strerror(reason)),
              "check cable and power; `symrig list` shows the cameras"};
    case EACCES:
    case EPERM:
      return {ErrorCode::device_refused,
              fmt::format("no permission to open camera {} ({})", path, std::strerror(reason)),
              "join the group video: sudo usermod -aG video \"$USER\", then log in again"};
    case EBUSY:
      return {ErrorCode::device_refused, fmt::format("another program uses camera {}", path),
              fmt::format("close that program; `fuser -v {}` shows its name", path)};
    default:
      return {ErrorCode::device_refused,
              fmt::format("camera {} cannot be opened ({})", path, std::strerror(reason)),
              "`symrig list` shows the cameras"};
  }
}

bool interlaced(std::uint32_t field) {
  return field != V4L2_FIELD_NONE && field != V4L2_FIELD_ANY;
}

DriverFormat from_v4l2(const v4l2_format& format, bool multiplanar) {
  if (multiplanar) {
    const auto& pix = format.fmt.pix_mp;
    return {pix.pixelformat,
            {as_int(pix.height), as_int(pix.width)},
            pix.plane_fmt[0].bytesperline,
            pix.plane_fmt[0].sizeimage,
            interlaced(pix.field),
            pix.num_planes};
  }
  const auto& pix = format.fmt.pix;
  return {pix.pixelformat,       {as_int(pix.height), as_int(pix.width)},
          pix.bytesperline,      pix.sizeimage,
          interlaced(pix.field), 1};
}

/// The driver fills in the fields that are 0: bytes per line and bytes per picture.
void put(v4l2_format& format, bool multiplanar, std::uint32_t fourcc, Grid size) {
  const auto cols = static_cast<std::uint32_t>(size.cols), rows = static_cast<std::uint32_t>(size.rows);
  if (multiplanar) {
    auto& pix = format.fmt.pix_mp;
    pix.pixelformat = fourcc, pix.width = cols, pix.height = rows, pix.field = V4L2_FIELD_NONE;
    pix.num_planes = 1;
    pix.plane_fmt[0].bytesperline = pix.plane_fmt[0].sizeimage = 0;
  } else {
    auto& pix = format.fmt.pix;
    pix.pixelformat = fourcc, pix.width = cols, pix.height = rows, pix.field = V4L2_FIELD_NONE;
    pix.bytesperline = pix.sizeimage = 0;
  }
}

}  // namespace

int as_int(std::uint32_t value) {
  return static_cast<int>(std::min<std::uint32_t>(value, std::numeric_limits<int>::max()));
}

bool is_gone(int reason) {
  return reason == ENODEV || reason == ENXIO || reason == ESHUTDOWN;
}

Result<OpenNode> OpenNode::open(VideoSystem& system, const std::string& path) {
  std::unique_ptr<VideoNode> node;
  if (const int reason = system.open(path, node); reason != 0) return cannot_open(path, reason);
  OpenNode driver(path, std::move(node));
  SYMRIG_CHECK(driver.identify());
  return driver;
}

Result<OpenNode> OpenNode::open_camera(VideoSystem& system, const std::string& path) {
  SYMRIG_TRY(auto driver, open(system, path));
  if (driver.identity().captures) return driver;
  return Error{ErrorCode::device_refused,
               fmt::format("{} ({}) does not stream pictures", path, driver.identity().name),
               "`symrig list` shows the cameras"};
}

std::uint32_t OpenNode::buffer_type() const {
  return identity_.multiplanar ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
}

int OpenNode::call(unsigned long request, void* argument) {
  int reason = EINTR;
  // A driver that always reports EINTR must not hang the caller, so the attempts are limited.
  for (int attempt = 0; reason == EINTR && attempt < 1000; ++attempt)
    reason = node_->control(request, argument);
  return reason;
}

Result<void> OpenNode::ask(unsigned long request, void* argument, std::string_view doing) {
  if (const int reason = call(request, argument); reason != 0) return error(reason, doing);
  return {};
}

Error OpenNode::error(int reason, std::string_view doing) const {
  const std::string camera = identity_.name.empty() ? path_ : fmt::format("{} ({})", path_, identity_.name);
  if (is_gone(reason))
    return {ErrorCode::device_lost,
            fmt::format("camera {} is lost: {}: {}", camera, doing, std::strerror(reason)),
            "check cable and power, then connect it again"};
  if (reason == EBUSY)
    return {ErrorCode::device_refused,
            fmt::format("another program uses camera {}: {}: {}", camera, doing, std::strerror(reason)),
            fmt::format("close that program; `fuser -v {}` shows its name", path_)};
  return {ErrorCode::device_refused, fmt::format("camera {}: {}: {}", camera, doing, std::strerror(reason)),
          "look for the cause in the kernel log (dmesg)"};
}

Result<void> OpenNode::identify() {
  v4l2_capability answer{};
  if (const int reason = call(VIDIOC_QUERYCAP, &answer); reason != 0) {
    if (is_gone(reason)) return error(reason, "querying its type");
    return Error{ErrorCode::device_refused,
                 fmt::format("{} is not a V4L2 device ({})", path_, std::strerror(reason)),
                 "`symrig list` shows the cameras"};
  }
  const std::uint32_t able =
      (answer.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? answer.device_caps : answer.capabilities;
  const bool single = (able & V4L2_CAP_VIDEO_CAPTURE) != 0;
  identity_ = {text(answer.card), text(answer.driver), text(answer.bus_info), false, false};
  identity_.multiplanar = !single && (able & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0;
  identity_.captures = (single || identity_.multiplanar) && (able & V4L2_CAP_STREAMING) != 0;
  return {};
}

Result<DriverFormat> OpenNode::format() {
  v4l2_format format{};
  format.type = buffer_type();
  SYMRIG_CHECK(ask(VIDIOC_G_FMT, &format, "reading its format"));
  return from_v4l2(format, identity_.multiplanar);
}

Result<DriverFormat> OpenNode::set_format(std::uint32_t fourcc, Grid size) {
  v4l2_format format{};
  format.type = buffer_type();
  SYMRIG_CHECK(ask(VIDIOC_G_FMT, &format, "reading its format"));
  put(format, identity_.multiplanar, fourcc, size);
  SYMRIG_CHECK(ask(VIDIOC_S_FMT, &format,
                   fmt::format("setting the format {} {}", fourcc_text(fourcc), to_string(size))));
  return from_v4l2(format, identity_.multiplanar);
}

}  // namespace symrig::camera
