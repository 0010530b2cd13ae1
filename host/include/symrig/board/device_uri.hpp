// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// How bytes reach a board.
enum class Transport : std::uint8_t {
  sim,           ///< a board in this process, in virtual time
  usb,           ///< bulk pipes of a vendor interface
  serial,        ///< a serial port
  tcp,           ///< raw wire bytes over TCP
  unix_socket,   ///< raw wire bytes over a local socket
  virtual_tcp,   ///< a board in virtual time behind a TCP port (docs/howto-boards.md)
  virtual_unix,  ///< a board in virtual time behind a local socket
};

/// Where a board is:
///   sim:                       sim:?jumper=OUT:IN
///   usb:                       usb:SERIAL
///   serial:/dev/ttyACM0        serial:/dev/ttyUSB0?baud=921600
///   tcp:HOST:PORT              unix:PATH
///   virtual:tcp:HOST:PORT      virtual:unix:PATH          either with ?jumper=GPIO:GPIO
/// An IPv6 address stands in brackets: tcp:[::1]:4000.
struct DeviceUri {
  Transport transport = Transport::sim;
  /// usb: the serial number or its beginning, empty for the only board; serial and unix: the path; tcp: the
  /// host.
  std::string place = {};
  std::uint16_t port = 0;        ///< tcp
  std::uint32_t baud = 115'200;  ///< serial; a USB serial port accepts any
  std::string jumper_from = {};  ///< sim and virtual: a wire from this output ...
  std::string jumper_to = {};    ///< ... to this input, in place of the projector and the camera

  bool operator==(const DeviceUri&) const = default;

  /// fails: bad_argument (the message names the error and the valid forms).
  static Result<DeviceUri> parse(std::string_view text);
  /// The inverse of parse().
  std::string text() const;
};

/// True if the text begins like a DeviceUri ("usb:", "virtual:", ...). A serial number does not.
bool looks_like_uri(std::string_view text);

/// How a DeviceUri can begin: "usb:", "sim:", ...
std::vector<std::string_view> device_schemes();

}  // namespace symrig
