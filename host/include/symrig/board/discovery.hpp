// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/device_uri.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A USB device that has a vendor interface (class ff) with one bulk pipe each way.
struct UsbDevice {
  std::uint16_t vendor = 0, product_id = 0;
  std::string maker = {}, product = {}, serial = {};  ///< its strings; empty where it has none
  std::string port = {};                              ///< "1-4.2": bus and the hubs' ports on the way
  bool accessible = false;                            ///< this user may open it
};

/// What is plugged in. A seam: tests put a list of their own here.
class UsbBus {
 public:
  UsbBus() = default;
  UsbBus(const UsbBus&) = delete;
  UsbBus& operator=(const UsbBus&) = delete;
  virtual ~UsbBus() = default;

  /// fails: io (the system has no USB).
  virtual Result<std::vector<UsbDevice>> devices() = 0;
};

/// The system's, through libusb. Opens no device: strings come from sysfs.
std::unique_ptr<UsbBus> system_usb_bus();

/// Ours: vendor 1209 (pid.codes, whose product numbers many projects share) and a maker or product that
/// begins with "symrig".
bool is_symrig(const UsbDevice& device);

/// A board that could be opened.
struct FoundBoard {
  DeviceUri uri;
  std::string serial = {};   ///< the board's unique id, empty if it has not been asked
  std::string product = {};  ///< "symrig trigger board"
  std::string port = {};     ///< USB port or path of the serial port
  bool accessible = true;
};

/// What a USB device is as a board.
FoundBoard as_board(const UsbDevice& device);

/// Boards on USB, then on USB serial ports (a board seen on both counts once, as the USB one), in order of
/// their serial numbers. The simulated board and boards behind sockets are not looked for. serial_ports: a
/// folder of links as udev makes them.
/// fails: io.
Result<std::vector<FoundBoard>> find_boards(UsbBus& bus,
                                            const std::filesystem::path& serial_ports = "/dev/serial/by-id");
Result<std::vector<FoundBoard>> find_boards();

/// Which board the user means. wanted: a DeviceUri, or how a serial number begins (upper and lower case are
/// one); empty: the only board there is. Never picks one of several.
/// fails: device_lost (no board there), unknown_name (no such serial number), bad_argument (several fit: the
/// text lists them; a malformed uri).
Result<DeviceUri> choose_board(std::span<const FoundBoard> found, std::string_view wanted);

/// wanted, or where it is empty the environment's SYMRIG_DEVICE; looks for boards only if it must.
/// fails: as find_boards and choose_board.
Result<DeviceUri> choose_board(std::string_view wanted);

}  // namespace symrig
