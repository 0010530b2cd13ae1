// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/flip_events.hpp"

#include "symrig/base/time.hpp"

#include <array>
#include <cerrno>
#include <cstring>

#include <poll.h>
#include <unistd.h>
#include <xf86drm.h>

namespace symrig::projector::drm {
namespace {

FlipEvent decode(const drm_event_vblank& raw) {
  const Nanoseconds stamp{std::int64_t{raw.tv_sec} * 1'000'000'000 + std::int64_t{raw.tv_usec} * 1'000};
  return {raw.user_data, raw.sequence, {stamp}};
}

}  // namespace

Answer<FlipEvent> FlipEvents::next(int card, Nanoseconds patience) {
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

}  // namespace symrig::projector::drm
