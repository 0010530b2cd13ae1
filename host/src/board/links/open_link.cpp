// SPDX-License-Identifier: Apache-2.0
#include "board/links/links.hpp"
#include "symrig/base/files.hpp"
#include "symrig/board/link.hpp"
#include "symrig/board/virtual_bench.hpp"

#include <string>

namespace symrig {
namespace {

using namespace std::chrono_literals;
constexpr Nanoseconds kDialPatience = 5s;
/// An Arduino restarts when its port opens. Its boot loader waits for a second for a new program, then the
/// board starts.
constexpr Nanoseconds kSerialRestart = 2s;

Result<std::unique_ptr<Link>> over(Result<Fd> fd, const DeviceUri& uri, Nanoseconds restart_time = {}) {
  if (!fd) return std::move(fd).error();
  return board::make_stream_link(std::move(fd).value(), uri.text(), restart_time);
}

Result<std::unique_ptr<Link>> open_virtual(const DeviceUri& uri) {
  SYMRIG_TRY(const VirtualBench bench, VirtualBench::connect(uri));
  if (!uri.jumper_from.empty())
    SYMRIG_CHECK(bench.jumper(static_cast<std::uint8_t>(std::stoul(uri.jumper_from)),
                              static_cast<std::uint8_t>(std::stoul(uri.jumper_to))));
  return bench.link();
}

}  // namespace

Result<std::unique_ptr<Link>> open_link(const DeviceUri& uri) {
  switch (uri.transport) {
    case Transport::sim:
      return board::open_sim_device(uri);
    case Transport::usb:
      return board::open_usb(uri.place);
    case Transport::serial:
      return over(board::open_serial(uri.place, uri.baud), uri, kSerialRestart);
    case Transport::tcp:
      return over(board::connect_tcp(uri.place, uri.port, kDialPatience), uri);
    case Transport::unix_socket:
      return over(board::connect_unix(uri.place), uri);
    case Transport::virtual_tcp:
    case Transport::virtual_unix:
      return open_virtual(uri);
  }
  return Error{ErrorCode::bad_argument, "unknown kind of link"};
}

}  // namespace symrig
