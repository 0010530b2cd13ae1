// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/serial_line.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <termios.h>

namespace symrig {
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

}  // namespace

Result<std::uint32_t> serial_speed(std::uint32_t baud) {
  const auto* rate = std::ranges::find(kRates, baud, &Rate::baud);
  if (rate != kRates.end()) return rate->code;
  const auto* above = std::ranges::upper_bound(kRates, baud, {}, &Rate::baud);
  return Error{ErrorCode::bad_argument, fmt::format("serial ports have no rate of {} baud", baud),
               fmt::format("use {} baud", above == kRates.end() ? kRates.back().baud : above->baud)};
}

bool make_raw_line(int descriptor, std::uint32_t speed) {
  termios settings{};
  if (::tcgetattr(descriptor, &settings) != 0) return false;
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB);
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  ::cfsetspeed(&settings, speed);
  return ::tcsetattr(descriptor, TCSANOW, &settings) == 0;
}

}  // namespace symrig
