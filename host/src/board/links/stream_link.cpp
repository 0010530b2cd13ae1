// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/files.hpp"
#include "symrig/base/internal/byte_stream.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/internal/links.hpp"

#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

namespace symrig::board {
namespace {

using namespace std::chrono_literals;
constexpr Nanoseconds kSendPatience = 2s;  // a board accepts its bytes within milliseconds

class StreamLink final : public Link {
 public:
  StreamLink(base::ByteStream stream, Nanoseconds restart_time)
      : stream_(std::move(stream)), opened_(steady_now()), restart_time_(restart_time) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override {
    return stream_.send(bytes, kSendPatience);
  }
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override { return stream_.receive(timeout); }
  Nanoseconds now() const override { return steady_now() - opened_; }
  SteadyTime opened() const override { return {opened_}; }
  Nanoseconds restart_time() const override { return restart_time_; }

 private:
  base::ByteStream stream_;
  Nanoseconds opened_, restart_time_;
};

}  // namespace

std::unique_ptr<Link> make_stream_link(Fd fd, std::string name, Nanoseconds restart_time) {
  return std::make_unique<StreamLink>(base::ByteStream(std::move(fd), std::move(name)), restart_time);
}

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

namespace {

Error unreachable(const std::string& place, std::string_view why) {
  return {ErrorCode::device_lost, fmt::format("{} cannot be reached ({})", place, why),
          "check that a board's server runs there"};
}

/// 0 or the errno of a connection in progress on a non-blocking socket.
int outcome(int fd, Nanoseconds patience) {
  pollfd one{fd, POLLOUT, 0};
  const auto milliseconds = std::chrono::ceil<std::chrono::milliseconds>(patience).count();
  int ready = 0;
  do {
    ready = ::poll(&one, 1, static_cast<int>(milliseconds));
  } while (ready < 0 && errno == EINTR);
  if (ready < 0) return errno;
  if (ready == 0) return ETIMEDOUT;
  int error = 0;
  socklen_t size = sizeof(error);
  return ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
}

/// 0 or an errno.
int connect_within(int fd, const sockaddr* address, socklen_t size, Nanoseconds patience) {
  if (::connect(fd, address, size) == 0) return 0;
  return errno == EINPROGRESS || errno == EINTR ? outcome(fd, patience) : errno;
}

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};

}  // namespace

Result<Fd> connect_unix(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path))
    return Error{ErrorCode::bad_argument, fmt::format("unix:{}: the path is too long for a socket", path),
                 fmt::format("use one of at most {} bytes", sizeof(address.sun_path) - 1)};
  std::memcpy(address.sun_path, path.data(), path.size());
  Fd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd) return unreachable(path, std::strerror(errno));
  // A local socket connects at once or fails; if its queue of waiting clients is full, it fails with EAGAIN.
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): how sockets take addresses
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    return unreachable(path, std::strerror(errno));
  return fd;
}

Result<Fd> connect_tcp(const std::string& host, std::uint16_t port, Nanoseconds patience) {
  const std::string place = fmt::format("{}:{}", host, port);
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int code = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found); code != 0)
    return unreachable(place, ::gai_strerror(code));
  const std::unique_ptr<addrinfo, FreeAddresses> addresses(found);
  int error = EADDRNOTAVAIL;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    Fd fd(::socket(one->ai_family, one->ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, one->ai_protocol));
    error = fd ? connect_within(fd.get(), one->ai_addr, one->ai_addrlen, patience) : errno;
    if (error != 0) continue;
    const int on = 1;
    ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    return fd;
  }
  return unreachable(place, std::strerror(error));
}

}  // namespace symrig::board
