// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/clock_model.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A wire from an output of the board to one of its inputs. The input must stamp edges.
struct Jumper {
  std::string output, input;
};

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

namespace symrig::board_sim {
class SimBoard;
}

namespace symrig {

/// A pipe of bytes to one board, with its own clock: real time on a cable, virtual time in this process.
class Link {
 public:
  Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  virtual ~Link() = default;

  /// Sends all bytes. fails: device_lost.
  virtual Result<void> send(std::span<const std::uint8_t> bytes) = 0;
  /// Waits until bytes arrive. Returns an empty result after `timeout`. fails: device_lost.
  virtual Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) = 0;
  /// Time on the link's clock since it was opened.
  virtual Nanoseconds now() const = 0;
  /// When the link was opened, on this machine's clock: now() counts from there. A link in virtual time uses
  /// the clock of that virtual time instead.
  virtual SteadyTime opened() const { return {}; }
  /// Opening the link may restart the board, which then needs so long. A boot loader that hears bytes
  /// meanwhile may stay, so the first question is asked once, and the next one after a silence of this
  /// length.
  virtual Nanoseconds restart_time() const { return Nanoseconds{0}; }
};

/// A link to a board in virtual time in this process. Waiting advances the board's clock. The board must
/// outlive the link.
std::unique_ptr<Link> make_sim_link(board_sim::SimBoard& board);

/// A link to the board at `uri`. sim: makes a new board with a 60 Hz projector and a camera on its lines; it
/// lives as long as the link. The link locks a serial port or a USB interface: no other program of symrig can
/// open it meanwhile.
/// fails: device_lost (no board, no permission, in use, connection refused; the message says which),
/// bad_argument (a baud rate that the system does not know, a path that is too long), unknown_name (a line of
/// the jumper), protocol (a virtual link of another version).
Result<std::unique_ptr<Link>> open_link(const DeviceUri& uri);

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

/// A simulated board behind a socket, in real time: for people who write a host of their own. It speaks the
/// bytes of the wire (protocol/PROTOCOL.md) with one host after the other. Its clock follows the steady clock
/// of this machine within a millisecond; its edges are exact in its own time. Only this machine reaches it.
class BoardServer {
 public:
  /// device: "sim:" or "sim:?jumper=OUT:IN". place: "unix:PATH", which must not exist, or "tcp:HOST:PORT"
  /// with a HOST of this machine (127.0.0.1, [::1], localhost). fails: bad_argument (another device or
  /// place), unknown_name (a line of the jumper), io (the socket cannot be made).
  static Result<BoardServer> open(const std::string& device, const std::string& place);
  BoardServer(BoardServer&&) noexcept;
  BoardServer& operator=(BoardServer&&) noexcept;
  /// Removes the socket of unix:PATH.
  ~BoardServer();

  /// Serves until keep_going() is false. It is asked at least a hundred times a second.
  void run(const std::function<bool()>& keep_going);

 private:
  class ServedBoard;
  explicit BoardServer(std::unique_ptr<ServedBoard> served);
  std::unique_ptr<ServedBoard> served_;
};

}  // namespace symrig
