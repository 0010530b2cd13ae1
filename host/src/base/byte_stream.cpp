// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/internal/byte_stream.hpp"

#include "symrig/base/time.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

namespace symrig::base {
namespace {

constexpr std::size_t kPiece = 4096;

Error lost(const std::string& name, std::string_view why) {
  return {ErrorCode::device_lost, fmt::format("{}: {}", name, why),
          "check the board's cable and power supply, then connect again"};
}

bool again(int error) {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

/// write() without SIGPIPE on a socket that the other end has closed.
ssize_t put(int fd, std::span<const std::uint8_t> bytes) {
  const ssize_t sent = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  return sent < 0 && errno == ENOTSOCK ? ::write(fd, bytes.data(), bytes.size()) : sent;
}

timespec to_timespec(Nanoseconds time) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(time);
  return {static_cast<time_t>(whole.count()), static_cast<long>((time - whole).count())};
}

}  // namespace

/// Waits for one of `events` or the end of the stream. Returns whether it came within `timeout`.
Result<bool> ByteStream::wait(short events, Nanoseconds timeout) const {
  const Deadline deadline(timeout);
  while (true) {
    pollfd one{fd_.get(), events, 0};
    const timespec left = to_timespec(deadline.left());
    const int ready = ::ppoll(&one, 1, &left, nullptr);
    if (ready >= 0) return ready > 0;
    if (errno != EINTR) return lost(name_, std::strerror(errno));
  }
}

Result<void> ByteStream::send(std::span<const std::uint8_t> bytes, Nanoseconds patience) const {
  while (!bytes.empty()) {
    const ssize_t sent = put(fd_.get(), bytes);
    if (sent > 0) {
      bytes = bytes.subspan(sent);
      continue;
    }
    if (sent < 0 && !again(errno)) return lost(name_, std::strerror(errno));
    SYMRIG_TRY(const bool ready, wait(POLLOUT, patience));
    if (!ready) return lost(name_, fmt::format("accepted no bytes for {:.3g} s", seconds(patience)));
  }
  return {};
}

Result<std::vector<std::uint8_t>> ByteStream::receive(Nanoseconds timeout) const {
  std::vector<std::uint8_t> bytes;
  SYMRIG_TRY(const bool ready, wait(POLLIN, timeout));
  if (!ready) return bytes;
  bytes.resize(kPiece);
  const ssize_t count = ::read(fd_.get(), bytes.data(), bytes.size());
  if (count == 0) return lost(name_, "the other end has closed");
  if (count < 0 && !again(errno))
    return lost(name_, errno == EIO ? "the device is gone" : std::strerror(errno));
  bytes.resize(std::max<ssize_t>(count, 0));
  return bytes;
}

}  // namespace symrig::base

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
