// SPDX-License-Identifier: Apache-2.0
#include "board/links/serial_port.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>

namespace symrig::board {
namespace {

struct Rate {
  std::uint32_t baud;
  speed_t code;
};
constexpr std::array<Rate, 14> kRates{{{9'600, B9600},
                                       {19'200, B19200},
                                       {38'400, B38400},
                                       {57'600, B57600},
                                       {115'200, B115200},
                                       {230'400, B230400},
                                       {460'800, B460800},
                                       {500'000, B500000},
                                       {921'600, B921600},
                                       {1'000'000, B1000000},
                                       {1'500'000, B1500000},
                                       {2'000'000, B2000000},
                                       {3'000'000, B3000000},
                                       {4'000'000, B4000000}}};

Error cannot_open(const std::string& path, int error) {
  std::string hint = "symrig list shows the connected boards";
  if (error == EACCES || error == EPERM)
    hint = "install the udev rule (docs/howto-boards.md), or join the port's group";
  if (error == EBUSY || error == EWOULDBLOCK) hint = "end the other program that has the port open";
  return {ErrorCode::device_lost, fmt::format("{} cannot be opened ({})", path, std::strerror(error)), hint};
}

Result<speed_t> speed(std::uint32_t baud) {
  const auto* rate =
      std::find_if(kRates.begin(), kRates.end(), [baud](const Rate& one) { return one.baud == baud; });
  if (rate != kRates.end()) return rate->code;
  const auto* above =
      std::find_if(kRates.begin(), kRates.end(), [baud](const Rate& one) { return one.baud > baud; });
  return Error{ErrorCode::bad_argument, fmt::format("serial ports have no rate of {} baud", baud),
               fmt::format("use {} baud", above == kRates.end() ? kRates.back().baud : above->baud)};
}

/// Raw: every byte passes unchanged, and a read returns the bytes that have arrived.
Result<void> make_raw(const base::Fd& port, const std::string& path, speed_t code) {
  termios settings{};
  if (::tcgetattr(port.get(), &settings) != 0)
    return Error{ErrorCode::bad_argument, fmt::format("{} is not a serial port", path),
                 "give a device such as /dev/ttyACM0"};
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB);
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  ::cfsetspeed(&settings, code);
  if (::tcsetattr(port.get(), TCSANOW, &settings) != 0) return cannot_open(path, errno);
  return {};
}

/// DTR tells a board that a host is connected. A port without modem lines (a pseudo-terminal) has no DTR.
void raise_lines(const base::Fd& port) {
  int lines = TIOCM_DTR | TIOCM_RTS;
  ::ioctl(port.get(), TIOCMBIS, &lines);
}

}  // namespace

Result<base::Fd> open_serial(const std::string& path, std::uint32_t baud) {
  SYMRIG_TRY(const speed_t code, speed(baud));
  base::Fd port(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
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
