// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlp/hid_transport.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::projector::dlp {

/// A kind of controller that symrig drives, with its USB numbers.
struct ControllerKind {
  std::string_view name;
  std::uint16_t vendor, product;
  bool operator==(const ControllerKind&) const = default;
};

inline constexpr ControllerKind kDlpc350{"DLPC350", 0x0451, 0x6401};
inline constexpr ControllerKind kDlpc900{"DLPC900", 0x0451, 0xC900};
inline constexpr std::array kControllerKinds{kDlpc350, kDlpc900};

/// A controller on this computer's USB.
struct FoundController {
  ControllerKind kind;
  std::string path;     ///< "/dev/hidraw0"
  std::string maker;    ///< as the device says
  std::string product;  ///< as the device says
  std::string serial;   ///< may be empty
};

/// Lists the controllers. Changes nothing. Empty in a build without hidapi.
std::vector<FoundController> find_controllers();

/// The error if nothing of this name is at a path, or anywhere: device_lost; device_refused if this build has
/// no hidapi.
Error missing(std::string_view name, const std::string& path);

/// path: "/dev/hidraw0"; empty: the only controller of this kind.
/// fails: as missing(), device_lost (no permission, or in use), bad_argument (several match).
Result<std::unique_ptr<HidTransport>> open_transport(const ControllerKind& kind, const std::string& path);

}  // namespace symrig::projector::dlp
