// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/hotplug.hpp"

#include "symrig/base/fd.hpp"

#include <algorithm>
#include <array>
#include <cerrno>

#include <linux/netlink.h>
#include <sys/socket.h>

namespace symrig::projector::drm {
namespace {

constexpr unsigned kKernelGroup = 1;  // 2 are udev's own messages

Fd listen() {
  Fd fd(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_KOBJECT_UEVENT));
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = kKernelGroup;
  if (!fd || ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return {};
  return fd;
}

}  // namespace

bool tells_of_plug(std::string_view text, const std::string& card, std::uint32_t connector) {
  bool drm = false, hotplug = false, ours = false, other = false;
  const std::string device = "DEVNAME=dri/" + card;
  const std::string own = "CONNECTOR=" + std::to_string(connector);
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\0'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    drm |= line == "SUBSYSTEM=drm";
    hotplug |= line == "HOTPLUG=1";
    ours |= line == device;
    other |= line.starts_with("PROPERTY=") || (line.starts_with("CONNECTOR=") && line != own);
  }
  return drm && hotplug && ours && !other;
}

HotplugEar::HotplugEar(std::string card) : card_(std::move(card)), socket_(listen()) {}

bool HotplugEar::heard(std::uint32_t connector) {
  if (!socket_) return false;
  std::array<char, 8192> message{};
  bool plug = false;
  while (true) {
    sockaddr_nl from{};
    socklen_t length = sizeof from;
    const ssize_t got = ::recvfrom(socket_.get(), message.data(), message.size(), 0,
                                   reinterpret_cast<sockaddr*>(&from), &length);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && errno == ENOBUFS) {  // more came than the socket holds: what was lost cannot be known
      plug = true;
      continue;
    }
    if (got <= 0) return plug;
    // Only the kernel itself is port 0: any program may send to this group otherwise.
    if (from.nl_pid == 0)
      plug |= tells_of_plug({message.data(), static_cast<std::size_t>(got)}, card_, connector);
  }
}

}  // namespace symrig::projector::drm
