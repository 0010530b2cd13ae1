// SPDX-License-Identifier: Apache-2.0
#include "board/links/links.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/internal/byte_stream.hpp"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

namespace symrig::board {
namespace {

Error cannot_open(const std::string& path, int error) {
  std::string hint = "symrig list shows the connected boards";
  if (error == EACCES || error == EPERM)
    hint = "install the udev rule (docs/howto-boards.md), or join the port's group";
  if (error == EBUSY || error == EWOULDBLOCK) hint = "end the other program that has the port open";
  return {ErrorCode::device_lost, fmt::format("{} cannot be opened ({})", path, std::strerror(error)), hint};
}

Result<void> make_raw(const Fd& port, const std::string& path, std::uint32_t speed) {
  if (make_raw_line(port.get(), speed)) return {};
  if (::isatty(port.get()) == 0)
    return Error{ErrorCode::bad_argument, fmt::format("{} is not a serial port", path),
                 "give a device such as /dev/ttyACM0"};
  return cannot_open(path, errno);
}

/// DTR tells a board that a host is connected. A port without modem lines (a pseudo-terminal) has no DTR.
void raise_lines(const Fd& port) {
  int lines = TIOCM_DTR | TIOCM_RTS;
  ::ioctl(port.get(), TIOCMBIS, &lines);
}

}  // namespace

Result<Fd> open_serial(const std::string& path, std::uint32_t baud) {
  SYMRIG_TRY(const std::uint32_t code, serial_speed(baud));
  Fd port(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!port) return cannot_open(path, errno);
  // The lock excludes other programs of symrig; TIOCEXCL excludes all others (except root).
  if (::flock(port.get(), LOCK_EX | LOCK_NB) != 0) return cannot_open(path, errno);
  SYMRIG_CHECK(make_raw(port, path, code));
  ::ioctl(port.get(), TIOCEXCL);
  raise_lines(port);
  ::tcflush(port.get(), TCIOFLUSH);
  return port;
}

}  // namespace symrig::board
