// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace symrig::projector::dlp {

/// A HID report has 64 bytes in both directions, without a report number.
inline constexpr std::size_t kReportBytes = 64;
using Report = std::array<std::uint8_t, kReportBytes>;

/// Carries reports to a controller and back. Tests put an emulated controller behind it.
class HidTransport {
 public:
  HidTransport() = default;
  HidTransport(const HidTransport&) = delete;
  HidTransport& operator=(const HidTransport&) = delete;
  virtual ~HidTransport() = default;

  /// fails: device_lost (unplugged).
  virtual Result<void> write(const Report& report) = 0;
  /// Waits for a report. fails: timeout (none came within `patience`), device_lost.
  virtual Result<Report> read(Nanoseconds patience) = 0;
  /// For messages: "DLPC350 at /dev/hidraw0".
  virtual std::string name() const = 0;
};

}  // namespace symrig::projector::dlp
