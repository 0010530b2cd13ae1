// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/link.hpp"

#include <cstdint>
#include <memory>
#include <vector>

#include <libusb.h>

namespace symrig::board::usb {

struct CloseContext {
  void operator()(libusb_context* context) const { libusb_exit(context); }
};
struct CloseHandle {
  void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
};
struct Unreference {
  void operator()(libusb_device* device) const { libusb_unref_device(device); }
};
using Context = std::unique_ptr<libusb_context, CloseContext>;
using Handle = std::unique_ptr<libusb_device_handle, CloseHandle>;
using Device = std::unique_ptr<libusb_device, Unreference>;

/// fails: io.
Result<Context> make_context();

/// The vendor interface's pipes.
struct Pipes {
  std::uint8_t interface = 0;
  std::uint8_t in = 0, out = 0;  ///< endpoint addresses
  std::uint16_t in_packet = 0;   ///< bytes of one packet from the board
};

/// A device with such an interface.
struct Candidate {
  Device device;
  Pipes pipes;
  UsbDevice about;
};

/// fails: io.
Result<std::vector<Candidate>> candidates(libusb_context& context);

}  // namespace symrig::board::usb
