// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <netinet/in.h>

namespace symrig::camera {

/// The kernel's account of the socket to which a camera sends its frames. A packet that finds the socket full
/// is lost before Aravis sees it, so only the kernel can count it.
class StreamSocket {
 public:
  /// The socket of this process that is bound to this address and port. nullptr: there is none.
  static std::unique_ptr<StreamSocket> bound_to(const sockaddr_in& at);
  StreamSocket(const StreamSocket&) = delete;
  StreamSocket& operator=(const StreamSocket&) = delete;
  ~StreamSocket();

  /// Sets how many bytes it may hold. Aravis does that at the first packet only, which is late for this
  /// frame.
  void hold(int bytes) const;
  /// Packets that found the socket full. None: this kernel does not count them (before Linux 4.12).
  std::optional<std::uint64_t> dropped() const;
  /// Aravis has not read all packets yet.
  bool holds_packets() const;

 private:
  explicit StreamSocket(int own) : fd_(own) {}

  int fd_;  // a duplicate of Aravis's
};

}  // namespace symrig::camera
