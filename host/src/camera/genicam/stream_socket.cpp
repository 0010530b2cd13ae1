// SPDX-License-Identifier: Apache-2.0
#include "camera/genicam/stream_socket.hpp"

#include <array>
#include <charconv>
#include <filesystem>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <linux/sock_diag.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace symrig::camera {
namespace {

bool is_bound_to(int fd, const sockaddr_in& at) {
  int type = 0;
  socklen_t length = sizeof type;
  if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &length) != 0 || type != SOCK_DGRAM) return false;
  sockaddr_in here{};
  length = sizeof here;
  return getsockname(fd, reinterpret_cast<sockaddr*>(&here), &length) == 0 && here.sin_family == AF_INET &&
         here.sin_port == at.sin_port &&
         (here.sin_addr.s_addr == at.sin_addr.s_addr || here.sin_addr.s_addr == htonl(INADDR_ANY));
}

/// None: this kernel does not have it.
std::optional<std::uint32_t> memory_info(int fd, std::size_t index) {
  std::array<std::uint32_t, SK_MEMINFO_VARS> info{};
  socklen_t length = sizeof info;
  if (getsockopt(fd, SOL_SOCKET, SO_MEMINFO, info.data(), &length) != 0) return {};
  if (length < (index + 1) * sizeof info[0]) return {};
  return info.at(index);
}

}  // namespace

std::unique_ptr<StreamSocket> StreamSocket::bound_to(const sockaddr_in& at) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const std::string name = entry.path().filename();
    int fd = -1;
    std::from_chars(name.data(), name.data() + name.size(), fd);
    if (fd < 0 || !is_bound_to(fd, at)) continue;
    const int own = fcntl(fd, F_DUPFD_CLOEXEC, 0);
    if (own >= 0) return std::unique_ptr<StreamSocket>(new StreamSocket(own));
  }
  return {};
}

StreamSocket::~StreamSocket() {
  close(fd_);
}

void StreamSocket::hold(int bytes) const {
  setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
}

std::optional<std::uint64_t> StreamSocket::dropped() const {
  return memory_info(fd_, SK_MEMINFO_DROPS);
}

bool StreamSocket::holds_packets() const {
  pollfd readable{fd_, POLLIN, 0};
  return poll(&readable, 1, 0) > 0;
}

}  // namespace symrig::camera
