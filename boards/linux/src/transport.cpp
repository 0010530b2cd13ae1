// SPDX-License-Identifier: Apache-2.0
#include "transport.hpp"

#include "symrig/base/internal/byte_stream.hpp"
#include "symrig/protocol/messages.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <termios.h>
#include <unistd.h>

namespace symrig::board_linux {

std::size_t BufferedTransport::read(std::uint8_t* out, std::size_t room) {
  const std::size_t count = std::min(room, in_.size());
  std::copy_n(in_.begin(), count, out);
  in_.erase(in_.begin(), in_.begin() + static_cast<std::ptrdiff_t>(count));
  if (count > 0) drained();
  return count;
}

std::size_t BufferedTransport::room() const {
  return attached() ? kRoom - std::min(kRoom, out_.size()) : 0;
}

void BufferedTransport::write(const std::uint8_t* bytes, std::size_t size) {
  out_.insert(out_.end(), bytes, bytes + size);
  flush();
}

void BufferedTransport::turn_away() {
  protocol::BusyAnswer busy;
  const protocol::ByteView answer = busy.take({in_.data(), in_.size()});
  in_.clear();
  drained();
  write(answer.data, answer.size);
}

std::size_t LinkSwitch::read(std::uint8_t* out, std::size_t room) {
  return holder_ != nullptr ? holder_->read(out, room) : 0;
}

void LinkSwitch::write(const std::uint8_t* bytes, std::size_t size) {
  if (holder_ != nullptr) holder_->write(bytes, size);
}

void LinkSwitch::watch(std::vector<pollfd>& fds) const {
  for (const auto& transport : transports_) transport->watch(fds);
}

Transport* LinkSwitch::first_speaker() const {
  for (const auto& transport : transports_)
    if (transport.get() != holder_ && transport->attached() && transport->pending()) return transport.get();
  return nullptr;
}

bool LinkSwitch::serve(hal::Tick now) {
  for (const auto& transport : transports_) transport->serve();
  if (pending()) heard_ = now;
  Transport* speaker = first_speaker();
  const bool gone = holder_ != nullptr && !holder_->attached();
  const bool gives_way = holder_ != nullptr && speaker != nullptr && now - heard_ >= kSilence;
  if (gone || gives_way) {
    holder_ = nullptr;
    return true;
  }
  if (holder_ == nullptr && speaker != nullptr) {
    holder_ = speaker;
    heard_ = now;
    return true;
  }
  while (holder_ != nullptr && speaker != nullptr) {
    speaker->turn_away();
    speaker = first_speaker();
  }
  return false;
}

namespace {

Error cannot_open(const std::string& path, int error) {
  const char* hint = "check the path in board.toml";
  if (error == EACCES) hint = "run as a member of the port's group (dialout)";
  if (error == EWOULDBLOCK) hint = "end the other program that uses it (a login console?)";
  return {error == EACCES || error == EWOULDBLOCK ? ErrorCode::device_refused : ErrorCode::io,
          fmt::format("cannot open {} ({})", path, std::strerror(error)), hint};
}

}  // namespace

Result<std::unique_ptr<SerialTransport>> SerialTransport::open(const std::string& path, std::uint32_t baud) {
  SYMRIG_TRY(const std::uint32_t speed, serial_speed(baud));
  Fd port(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!port || ::flock(port.get(), LOCK_EX | LOCK_NB) != 0) return cannot_open(path, errno);
  if (!make_raw_line(port.get(), speed) || ::tcflush(port.get(), TCIOFLUSH) != 0)
    return Error{ErrorCode::bad_argument, fmt::format("{} is not a serial port", path),
                 "give a device such as /dev/ttyS0"};
  return std::unique_ptr<SerialTransport>(new SerialTransport(std::move(port), "serial:" + path));
}

void SerialTransport::watch(std::vector<pollfd>& fds) const {
  const auto wanted = static_cast<short>((in_.size() < kRoom ? POLLIN : 0) | (out_.empty() ? 0 : POLLOUT));
  if (port_) fds.push_back({port_.get(), wanted, 0});
}

void SerialTransport::serve() {
  std::array<std::uint8_t, 4096> piece{};
  while (port_ && in_.size() < kRoom) {
    const ssize_t got = ::read(port_.get(), piece.data(), piece.size());
    if (got > 0) {
      in_.insert(in_.end(), piece.begin(), piece.begin() + got);
      continue;
    }
    if (got < 0 && errno != EAGAIN && errno != EINTR) hang_up();
    break;
  }
  flush();
}

void SerialTransport::flush() {
  while (port_ && !out_.empty()) {
    const ssize_t sent = ::write(port_.get(), out_.data(), out_.size());
    if (sent > 0) {
      out_.erase(out_.begin(), out_.begin() + sent);
      continue;
    }
    if (sent < 0 && errno != EAGAIN && errno != EINTR) hang_up();
    return;
  }
}

void SerialTransport::hang_up() {
  port_.close();
  forget();
}

}  // namespace symrig::board_linux
