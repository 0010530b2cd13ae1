// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig::test {

/// The speeds of USB/IP (the kernel's enum usb_device_speed).
enum class UsbSpeed : std::uint8_t { full = 2, high = 3, super = 5 };

/// What a USB device says of itself (USB 2.0 and 3.0, chapter 9).
struct UsbDescription {
  using Bytes = std::vector<std::uint8_t>;
  std::string name;  ///< for the path that USB/IP asks for
  UsbSpeed speed = UsbSpeed::full;
  Bytes device;                                 ///< the device descriptor, 18 bytes
  Bytes configuration;                          ///< the configuration with all interfaces and endpoints
  std::vector<std::string> strings;             ///< of index 1 and up, ASCII
  std::map<std::uint8_t, Bytes> others;         ///< by descriptor type: HID's, BOS
  std::vector<std::uint8_t> interface_classes;  ///< class, subclass and protocol of each interface
};

/// An emulated device behind its descriptors. The server calls it with its mutex held.
class UsbDevice {
 public:
  using Bytes = std::vector<std::uint8_t>;
  UsbDevice() = default;
  UsbDevice(const UsbDevice&) = delete;
  UsbDevice& operator=(const UsbDevice&) = delete;
  virtual ~UsbDevice() = default;

  virtual const UsbDescription& description() const = 0;
  /// Bytes from the host to an endpoint. false: the device is unplugged.
  virtual bool out(unsigned endpoint, std::span<const std::uint8_t> bytes) = 0;
  /// What one read of at most `most` bytes gets. None: nothing yet; the read waits.
  virtual std::optional<Bytes> in(unsigned endpoint, std::size_t most) = 0;
};

}  // namespace symrig::test
