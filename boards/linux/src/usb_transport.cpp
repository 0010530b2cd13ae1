// SPDX-License-Identifier: Apache-2.0
#include "usb_transport.hpp"

#include "ffs_descriptors.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usb/functionfs.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace symrig::board_linux {
namespace {

Error no_gadget(const std::string& path, int error) {
  if (error == ENOENT)
    return {ErrorCode::not_found, fmt::format("{} does not exist", path),
            "mount a FunctionFS there with symrig-gadget start"};
  if (error == EACCES || error == EPERM)
    return {ErrorCode::device_refused, fmt::format("no permission to open {}", path),
            "mount it for the daemon's user with symrig-gadget start"};
  if (error == EBUSY)
    return {ErrorCode::device_refused, fmt::format("{} is in use", path), "end the other daemon that has it"};
  return {ErrorCode::io, fmt::format("{}: {}", path, std::strerror(error)), "see the kernel log"};
}

Result<Fd> open_endpoint(const std::string& mount, const char* file) {
  const std::string path = mount + "/" + file;
  Fd fd(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!fd) return no_gadget(path, errno);
  return fd;
}

Result<void> write_descriptors(const Fd& control, const std::vector<std::uint8_t>& bytes,
                               const std::string& mount) {
  if (::write(control.get(), bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size())) return {};
  return no_gadget(mount + "/ep0", errno);
}

/// Kernels expect different versions of Microsoft's descriptors and refuse other versions.
Result<void> describe(const Fd& control, const std::string& mount) {
  for (const unsigned microsoft : {0x0100U, 1U})
    if (write_descriptors(control, ffs_descriptors(microsoft), mount)) return {};
  return write_descriptors(control, ffs_descriptors(0), mount);
}

}  // namespace

Result<std::unique_ptr<UsbTransport>> UsbTransport::open(const std::string& mount) {
  SYMRIG_TRY(Fd control, open_endpoint(mount, "ep0"));
  SYMRIG_CHECK(describe(control, mount));
  SYMRIG_CHECK(write_descriptors(control, ffs_strings(), mount));
  SYMRIG_TRY(Fd from, open_endpoint(mount, "ep1"));
  SYMRIG_TRY(Fd to, open_endpoint(mount, "ep2"));
  SYMRIG_TRY(AioQueue aio, AioQueue::make(kReads + kWrites));
  return std::unique_ptr<UsbTransport>(
      new UsbTransport("usb:" + mount, std::move(control), std::move(from), std::move(to), std::move(aio)));
}

UsbTransport::UsbTransport(std::string name, Fd control, Fd out, Fd in, AioQueue aio)
    : name_(std::move(name)),
      control_(std::move(control)),
      from_(std::move(out)),
      to_(std::move(in)),
      aio_(std::move(aio)) {
  for (Transfer& read : reads_) read.buffer.resize(kLongestPacket);
  for (Transfer& write : writes_) write.buffer.resize(kPiece);
}

void UsbTransport::watch(std::vector<pollfd>& fds) const {
  fds.push_back({control_.get(), POLLIN, 0});
  fds.push_back({aio_.fd(), POLLIN, 0});
}

void UsbTransport::serve() {
  take_events();
  collect();
  read_on();
  flush();
}

/// Takes one event at a time, and none after a disconnect, so that the firmware sees the disconnect.
void UsbTransport::take_events() {
  usb_functionfs_event event{};
  bool was_attached = attached();
  while (::read(control_.get(), &event, sizeof event) == sizeof event) {
    take_event(event.type, (event.u.setup.bRequestType & USB_DIR_IN) != 0);
    if (was_attached && !attached()) return;
    was_attached = attached();
  }
}

void UsbTransport::take_event(unsigned type, bool to_host) {
  switch (type) {
    case FUNCTIONFS_ENABLE: {
      usb_endpoint_descriptor endpoint{};
      if (::ioctl(from_.get(), FUNCTIONFS_ENDPOINT_DESC, &endpoint) == 0)
        packet_ = std::clamp<std::size_t>(endpoint.wMaxPacketSize & 0x7FFU, 8, kLongestPacket);
      enabled_ = true;
      asleep_ = false;
      break;
    }
    case FUNCTIONFS_DISABLE:
    case FUNCTIONFS_UNBIND:
      enabled_ = false;
      close_with_empty_ = false;
      forget();
      break;
    case FUNCTIONFS_SUSPEND:
      asleep_ = true;
      break;
    case FUNCTIONFS_RESUME:
      asleep_ = false;
      break;
    case FUNCTIONFS_SETUP:
      // There are no control requests. An access in the wrong direction stalls, which is how USB refuses
      // them.
      if (to_host) {
        [[maybe_unused]] const ssize_t stalled = ::read(control_.get(), nullptr, 0);
      } else {
        [[maybe_unused]] const ssize_t stalled = ::write(control_.get(), nullptr, 0);
      }
      break;
    default:
      break;
  }
}

void UsbTransport::collect() {
  aio_.quiet();
  for (auto done = aio_.completed(); !done.empty(); done = aio_.completed()) {
    for (const Completed& one : done) {
      if (!one.transfer->input || one.result <= 0 || !enabled_) continue;
      const auto begin = one.transfer->buffer.begin();
      in_.insert(in_.end(), begin, begin + one.result);
    }
  }
}

/// Requests reads one after the other, so that packets keep their order. Requests none while the firmware is
/// behind: the host then waits, and no bytes are lost.
void UsbTransport::read_on() {
  while (enabled_ && in_.size() + kReads * packet_ <= kRoom && !reads_.at(next_read_).busy) {
    if (!aio_.submit(reads_.at(next_read_), from_.get(), packet_, true)) return;
    next_read_ = (next_read_ + 1) % kReads;
  }
}

void UsbTransport::flush() {
  while (enabled_ && (!out_.empty() || close_with_empty_) && !writes_.at(next_write_).busy)
    if (!write_piece()) return;
}

bool UsbTransport::write_piece() {
  Transfer& write = writes_.at(next_write_);
  const std::size_t size = std::min(out_.size(), kPiece);
  std::copy_n(out_.begin(), size, write.buffer.begin());
  if (!aio_.submit(write, to_.get(), size, false)) return false;
  out_.erase(out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(size));
  next_write_ = (next_write_ + 1) % kWrites;
  close_with_empty_ = size > 0 && size % packet_ == 0;
  return true;
}

}  // namespace symrig::board_linux
