// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <netinet/in.h>

namespace symrig::camera {

/// The network interface of this computer with this address.
struct NetworkInterface {
  std::string name;  ///< "eth0"
  int mtu = 0;       ///< the largest packet that it carries [bytes]
};

/// None: no interface has this address.
std::optional<NetworkInterface> interface_at(in_addr address);

/// Whether a camera's packets fit this computer's network. A network drops larger ones without a word, and no
/// frame arrives.
/// fails: device_refused.
Result<void> check_packet_size(std::string_view camera, int packet_bytes, const NetworkInterface& network);

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
