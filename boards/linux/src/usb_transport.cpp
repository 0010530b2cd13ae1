// SPDX-License-Identifier: Apache-2.0
#include "usb_transport.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usb/functionfs.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace symrig::board_linux {
namespace {

constexpr std::string_view kInterface = "symrig";
constexpr std::string_view kDriver = "WINUSB";
constexpr std::string_view kGuidName = "DeviceInterfaceGUIDs";
constexpr std::string_view kGuid = "{6B8A3D5C-9E0F-4C1B-8A57-2D4F1E7C9B30}";  // the same as in boards/pico
constexpr std::uint16_t kFullSpeedPacket = 64;
constexpr std::uint16_t kHighSpeedPacket = 512;
constexpr std::uint16_t kEnglish = 0x0409;
constexpr std::uint16_t kCompatibleId = 4;  // wIndex of Microsoft's compatible-id descriptor
constexpr std::uint16_t kProperties = 5;
constexpr std::uint32_t kListOfStrings = 7;

/// Little-endian bytes, one after the other.
class Bytes {
 public:
  void u8(unsigned value) { out_.push_back(static_cast<std::uint8_t>(value)); }
  void u16(unsigned value) {
    u8(value & 0xFFU);
    u8(value >> 8U & 0xFFU);
  }
  void u32(std::uint32_t value) {
    u16(value & 0xFFFFU);
    u16(value >> 16U);
  }
  void text(std::string_view text, std::size_t size) {
    for (std::size_t k = 0; k < size; ++k) u8(k < text.size() ? static_cast<unsigned char>(text[k]) : 0);
  }
  void append(const Bytes& other) { out_.insert(out_.end(), other.out_.begin(), other.out_.end()); }
  std::uint32_t size() const { return static_cast<std::uint32_t>(out_.size()); }
  std::vector<std::uint8_t> take() { return std::move(out_); }

 private:
  std::vector<std::uint8_t> out_;
};

Bytes interface_with(std::uint16_t packet) {
  Bytes out;
  out.u8(USB_DT_INTERFACE_SIZE), out.u8(USB_DT_INTERFACE), out.u8(0), out.u8(0), out.u8(2);
  out.u8(USB_CLASS_VENDOR_SPEC), out.u8(0), out.u8(0), out.u8(1);
  for (const unsigned address : {1U | USB_DIR_OUT, 1U | USB_DIR_IN}) {
    out.u8(USB_DT_ENDPOINT_SIZE), out.u8(USB_DT_ENDPOINT), out.u8(address), out.u8(USB_ENDPOINT_XFER_BULK);
    out.u16(packet), out.u8(0);
  }
  return out;
}

Bytes compatible_id(unsigned version) {
  Bytes out;
  constexpr std::uint32_t kSize = 10 + 24;
  out.u8(0), out.u32(kSize), out.u16(version), out.u16(kCompatibleId), out.u8(1), out.u8(0);
  out.u8(0), out.u8(1), out.text(kDriver, 8), out.text("", 8), out.text("", 6);
  return out;
}

/// The kernel converts these texts to UTF-16.
Bytes properties(unsigned version) {
  constexpr std::uint32_t kNameSize = kGuidName.size() + 1;
  constexpr std::uint32_t kGuidSize = kGuid.size() + 2;  // a list ends with an empty text
  constexpr std::uint32_t kProperty = 14 + kNameSize + kGuidSize;
  Bytes out;
  out.u8(0), out.u32(10 + kProperty), out.u16(version), out.u16(kProperties), out.u16(1);
  out.u32(kProperty), out.u32(kListOfStrings);
  out.u16(kNameSize), out.text(kGuidName, kNameSize);
  out.u32(kGuidSize), out.text(kGuid, kGuidSize);
  return out;
}

/// The first data to write to a FunctionFS's ep0. They describe the vendor interface of every symrig board:
/// one bulk endpoint in each direction, full and high speed. They also select the WinUSB driver on Windows.
/// The kernel needs Microsoft OS 1.0 descriptors for that; the Pico has version 2.0 with the same GUID.
/// microsoft: the descriptors' version that this kernel expects (0x0100; older kernels 1), 0 = none.
/// Then file ep1 is the endpoint from the host, and ep2 the one to the host.
std::vector<std::uint8_t> ffs_descriptors(unsigned microsoft) {
  constexpr std::uint32_t kEach = 3;  // an interface, two endpoints
  Bytes body;
  body.u32(kEach), body.u32(kEach);
  if (microsoft != 0) body.u32(2);
  body.append(interface_with(kFullSpeedPacket));
  body.append(interface_with(kHighSpeedPacket));
  if (microsoft != 0) {
    body.append(compatible_id(microsoft));
    body.append(properties(microsoft));
  }
  const std::uint32_t flags = microsoft != 0 ? FUNCTIONFS_HAS_MS_OS_DESC : 0;
  Bytes out;
  out.u32(FUNCTIONFS_DESCRIPTORS_MAGIC_V2);
  out.u32(12 + body.size());
  out.u32(FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | flags);
  out.append(body);
  return out.take();
}

/// The name of the interface.
std::vector<std::uint8_t> ffs_strings() {
  Bytes out;
  constexpr std::uint32_t kTextSize = kInterface.size() + 1;
  out.u32(FUNCTIONFS_STRINGS_MAGIC), out.u32(16 + 2 + kTextSize), out.u32(1), out.u32(1);
  out.u16(kEnglish), out.text(kInterface, kTextSize);
  return out.take();
}

}  // namespace

Result<AioQueue> AioQueue::make(unsigned transfers) {
  aio_context_t context = 0;
  Fd bell(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  if (!bell || ::syscall(SYS_io_setup, transfers, &context) != 0)
    return Error{ErrorCode::io, fmt::format("no asynchronous input and output ({})", std::strerror(errno)),
                 "raise fs.aio-max-nr"};
  return AioQueue(context, std::move(bell));
}

AioQueue::AioQueue(AioQueue&& other) noexcept
    : context_(std::exchange(other.context_, 0)), bell_(std::move(other.bell_)) {}

AioQueue::~AioQueue() {
  if (context_ != 0) ::syscall(SYS_io_destroy, context_);
}

bool AioQueue::submit(Transfer& transfer, int fd, std::size_t size, bool input) {
  transfer.request = {};
  transfer.request.aio_data = std::bit_cast<std::uintptr_t>(&transfer);
  transfer.request.aio_fildes = static_cast<std::uint32_t>(fd);
  transfer.request.aio_lio_opcode = input ? IOCB_CMD_PREAD : IOCB_CMD_PWRITE;
  transfer.request.aio_buf = std::bit_cast<std::uintptr_t>(transfer.buffer.data());
  transfer.request.aio_nbytes = size;
  transfer.request.aio_flags = IOCB_FLAG_RESFD;
  transfer.request.aio_resfd = static_cast<std::uint32_t>(bell_.get());
  std::array<iocb*, 1> list{&transfer.request};
  transfer.input = input;
  transfer.busy = ::syscall(SYS_io_submit, context_, 1L, list.data()) == 1;
  return transfer.busy;
}

std::span<const Completed> AioQueue::completed() {
  std::array<io_event, 32> events{};
  timespec none{};
  const long count =
      ::syscall(SYS_io_getevents, context_, 0L, static_cast<long>(events.size()), events.data(), &none);
  std::size_t taken = 0;
  for (long k = 0; k < count; ++k) {
    const io_event& event = events.at(static_cast<std::size_t>(k));
    auto* const transfer = std::bit_cast<Transfer*>(static_cast<std::uintptr_t>(event.data));
    transfer->busy = false;
    completed_.at(taken++) = {transfer, event.res};
  }
  return std::span(completed_).first(taken);
}

void AioQueue::quiet() const {
  std::uint64_t count = 0;
  [[maybe_unused]] const ssize_t got = ::read(bell_.get(), &count, sizeof count);
}

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
