// SPDX-License-Identifier: Apache-2.0

#include "symrig/camera/internal/network.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <linux/sock_diag.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace symrig::camera {
namespace {

/// 0: unknown.
int mtu_of(std::string_view name) {
  ifreq request{};
  std::ranges::copy(name.substr(0, IFNAMSIZ - 1), std::begin(request.ifr_name));
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool known = fd >= 0 && ioctl(fd, SIOCGIFMTU, &request) == 0;
  if (fd >= 0) close(fd);
  return known ? request.ifr_mtu : 0;
}

}  // namespace

std::optional<NetworkInterface> interface_at(in_addr address) {
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return {};
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> all(list, freeifaddrs);
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    if (reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr.s_addr != address.s_addr) continue;
    return NetworkInterface{one->ifa_name, mtu_of(one->ifa_name)};
  }
  return {};
}

Result<void> check_packet_size(std::string_view camera, int packet_bytes, const NetworkInterface& network) {
  if (network.mtu == 0 || packet_bytes <= network.mtu) return {};
  return Error{ErrorCode::device_refused,
               fmt::format("camera {}: its packets of {} bytes do not fit the network {}, which carries {}",
                           camera, packet_bytes, network.name, network.mtu),
               fmt::format("set GevSCPSPacketSize = {} in [camera.features], or: sudo ip link set {} mtu {}",
                           network.mtu, network.name, packet_bytes)};
}

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
