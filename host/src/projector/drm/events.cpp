// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/files.hpp"
#include "symrig/base/time.hpp"
#include "symrig/projector/internal/drm.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <linux/netlink.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <xf86drm.h>

namespace symrig::projector::drm {
namespace {

FlipEvent decode(const drm_event_vblank& raw) {
  const Nanoseconds stamp{std::int64_t{raw.tv_sec} * 1'000'000'000 + std::int64_t{raw.tv_usec} * 1'000};
  return {raw.user_data, raw.sequence, {stamp}};
}

}  // namespace

KernelAnswer<FlipEvent> FlipEvents::next(int card, Nanoseconds patience) {
  const Deadline deadline(patience);
  while (waiting_.empty()) {
    // Rounded up: otherwise the loop would spin during the last millisecond.
    const Nanoseconds left = deadline.left();
    pollfd wanted{.fd = card, .events = POLLIN, .revents = 0};
    const int ready = ::poll(&wanted, 1, static_cast<int>((left.count() + 999'999) / 1'000'000));
    if (ready < 0 && errno != EINTR) return {errno, {}};
    if (ready > 0) {
      const Errno error = read_some(card);
      if (error != 0) return {error, {}};
    } else if (left.count() == 0) {
      return {ETIMEDOUT, {}};
    }
  }
  const FlipEvent event = waiting_.front();
  waiting_.pop_front();
  return {0, event};
}

Errno FlipEvents::read_some(int card) {
  std::array<std::byte, 1024> bytes{};
  const ssize_t got = ::read(card, bytes.data(), bytes.size());
  if (got < 0) return errno == EINTR || errno == EAGAIN ? 0 : errno;
  if (got == 0) return ENODEV;  // end of file: the card was removed
  std::size_t at = 0;
  const std::size_t length = got;
  while (at + sizeof(drm_event) <= length) {
    drm_event head{};
    std::memcpy(&head, bytes.data() + at, sizeof head);
    if (head.length < sizeof head || at + head.length > length) return EPROTO;
    if (head.type == DRM_EVENT_FLIP_COMPLETE && head.length >= sizeof(drm_event_vblank)) {
      drm_event_vblank flip{};
      std::memcpy(&flip, bytes.data() + at, sizeof flip);
      waiting_.push_back(decode(flip));
    }
    at += head.length;
  }
  return 0;
}

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
