// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/hotplug.hpp"

#include "symrig/base/files.hpp"

#include <algorithm>
#include <array>
#include <cerrno>

#include <linux/netlink.h>
#include <sys/socket.h>

namespace symrig::projector::drm {
namespace {

constexpr unsigned kKernelGroup = 1;  // group 2 has udev's own messages

Fd listen() {
  Fd fd(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_KOBJECT_UEVENT));
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = kKernelGroup;
  if (!fd || ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return {};
  return fd;
}

}  // namespace

bool is_hotplug_message(std::string_view text, const std::string& card, std::uint32_t connector) {
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

HotplugListener::HotplugListener(std::string card) : card_(std::move(card)), socket_(listen()) {}

bool HotplugListener::received(std::uint32_t connector) {
  if (!socket_) return false;
  std::array<char, 8192> message{};
  bool plug = false;
  while (true) {
    sockaddr_nl from{};
    socklen_t length = sizeof from;
    const ssize_t got = ::recvfrom(socket_.get(), message.data(), message.size(), 0,
                                   reinterpret_cast<sockaddr*>(&from), &length);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && errno == ENOBUFS) {  // overflow: assume a lost hot-plug message
      plug = true;
      continue;
    }
    if (got <= 0) return plug;
    // Only the kernel has port 0. Other programs may send to this group, too.
    if (from.nl_pid == 0)
      plug |= is_hotplug_message({message.data(), static_cast<std::size_t>(got)}, card_, connector);
  }
}

}  // namespace symrig::projector::drm
