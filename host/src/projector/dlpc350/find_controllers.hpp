// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlpc350/hid_transport.hpp"

#include <memory>
#include <string>
#include <vector>

namespace symrig::projector::dlpc350 {

/// USB numbers of a DLPC350.
inline constexpr std::uint16_t kVendor = 0x0451, kProduct = 0x6401;

/// A controller on this computer's USB.
struct FoundController {
  std::string path;     ///< "/dev/hidraw0"
  std::string maker;    ///< as the device says
  std::string product;  ///< as the device says
  std::string serial;   ///< may be empty
};

/// Lists the controllers. Changes nothing. Empty in a build without hidapi.
std::vector<FoundController> find_controllers();

/// path: "/dev/hidraw0"; empty: the only controller.
/// fails: device_lost (none is connected, or no permission), bad_argument (several match), device_refused
/// (this build has no hidapi).
Result<std::unique_ptr<HidTransport>> open_transport(const std::string& path);

}  // namespace symrig::projector::dlpc350
