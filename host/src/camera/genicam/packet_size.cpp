// SPDX-License-Identifier: Apache-2.0
#include "camera/genicam/packet_size.hpp"

#include <algorithm>
#include <memory>

#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
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

}  // namespace symrig::camera
