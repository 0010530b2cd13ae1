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
  std::string maker = {}, product = {}, serial = {};  ///< its strings; empty if it has none
  std::string port = {};                              ///< "1-4.2": the bus, then the port of each hub
  bool accessible = false;                            ///< this user has permission to open it
};

/// The connected USB devices. Virtual, so that tests can supply their own list.
class UsbBus {
 public:
  UsbBus() = default;
  UsbBus(const UsbBus&) = delete;
  UsbBus& operator=(const UsbBus&) = delete;
  virtual ~UsbBus() = default;

  /// fails: io (the system has no USB).
  virtual Result<std::vector<UsbDevice>> devices() = 0;
};

/// The system's USB devices, through libusb. Opens no device: the strings come from sysfs.
std::unique_ptr<UsbBus> system_usb_bus();

/// True for vendor 1209 (pid.codes, shared by many projects) with a maker or product that begins with
/// "symrig".
bool is_symrig(const UsbDevice& device);

/// A board that the search found.
struct FoundBoard {
  DeviceUri uri;
  std::string serial = {};   ///< the board's unique id, empty if not known
  std::string product = {};  ///< "symrig trigger board"
  std::string port = {};     ///< USB port or path of the serial port
  bool accessible = true;
};

/// A USB device as a board.
FoundBoard as_board(const UsbDevice& device);

/// Boards on USB, then boards on USB serial ports, in order of their serial numbers. A board on both counts
/// once, as USB. Does not search for the simulated board or boards behind sockets. serial_ports: a folder of
/// links as udev makes them.
/// fails: io.
Result<std::vector<FoundBoard>> find_boards(UsbBus& bus,
                                            const std::filesystem::path& serial_ports = "/dev/serial/by-id");
Result<std::vector<FoundBoard>> find_boards();

/// USB serial ports that may lead to a board of another maker (an Arduino), by name. Nobody can tell without
/// opening one, which restarts some boards, so find_boards() leaves them out.
std::vector<DeviceUri> other_serial_ports(const std::filesystem::path& serial_ports = "/dev/serial/by-id");

/// Chooses the board that the user wants. wanted: a DeviceUri, or the beginning of a serial number (in upper
/// or lower case); empty: the only board. Never picks one of several. fails: device_lost (no board),
/// unknown_name (no such serial number), bad_argument (several boards match: the message lists them; or a
/// malformed uri).
Result<DeviceUri> choose_board(std::span<const FoundBoard> found, std::string_view wanted);

/// Uses `wanted`, or if it is empty the environment variable SYMRIG_DEVICE. Searches for boards only if
/// needed. fails: as find_boards and choose_board.
Result<DeviceUri> choose_board(std::string_view wanted);

}  // namespace symrig
