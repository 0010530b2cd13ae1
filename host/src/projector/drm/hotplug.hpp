// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace symrig::projector::drm {

/// true: the message reports that a display of `card` ("card0") was connected or disconnected. Messages about
/// a property, or about a connector other than `connector`, do not count. text: a uevent from the kernel,
/// lines that end with a zero byte (Documentation/ABI: sysfs uevents; drm_sysfs_hotplug_event).
bool is_hotplug_message(std::string_view text, const std::string& card, std::uint32_t connector);

/// Receives the kernel's uevents. Without permission it never receives any.
class HotplugListener {
 public:
  explicit HotplugListener(std::string card);
  /// true: a hot-plug message has come since the last call.
  bool received(std::uint32_t connector);

 private:
  std::string card_;
  Fd socket_;
};

}  // namespace symrig::projector::drm
