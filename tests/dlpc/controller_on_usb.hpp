// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dlpc/emulated_controller.hpp"
#include "usbip/usbip_server.hpp"

#include <memory>

namespace symrig::test {

/// The USB interface of an emulated controller: HID, with a report of 64 bytes in each direction.
std::shared_ptr<UsbDevice> on_usb(std::shared_ptr<EmulatedController> device);

}  // namespace symrig::test
