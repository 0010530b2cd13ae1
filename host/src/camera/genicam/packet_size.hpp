// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

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

}  // namespace symrig::camera
