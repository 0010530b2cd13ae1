// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace symrig::projector::drm {

/// Does this message of the kernel tell that a plug of `card` ("card0") came in or went out? Messages about
/// one connector that is not `connector`, and about a changed property, do not. text: the uevent as the
/// kernel sends it, lines that end with a zero byte (Documentation/ABI: sysfs uevents;
/// drm_sysfs_hotplug_event).
bool tells_of_plug(std::string_view text, const std::string& card, std::uint32_t connector);

/// Listens to the kernel's uevents. Where that is not allowed it hears nothing.
class HotplugEar {
 public:
  explicit HotplugEar(std::string card);
  /// Anything since the last call?
  bool heard(std::uint32_t connector);

 private:
  std::string card_;
  Fd socket_;
};

}  // namespace symrig::projector::drm
