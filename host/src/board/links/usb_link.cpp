// SPDX-License-Identifier: Apache-2.0

#include "board/links/usb.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/internal/links.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <sys/time.h>
#include <unistd.h>

namespace symrig::board::usb {
namespace {

Error no_usb(int code) {
  return {ErrorCode::io, fmt::format("the USB devices cannot be listed ({})", libusb_strerror(code)),
          "name the board by its URI instead"};
}

struct FreeConfig {
  void operator()(libusb_config_descriptor* config) const { libusb_free_config_descriptor(config); }
};

std::optional<Pipes> pipes_of(const libusb_interface_descriptor& interface) {
  if (interface.bInterfaceClass != LIBUSB_CLASS_VENDOR_SPEC) return std::nullopt;
  Pipes pipes{.interface = interface.bInterfaceNumber};
  for (const auto& endpoint : std::span(interface.endpoint, interface.bNumEndpoints)) {
    if ((endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK) continue;
    if ((endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN) == 0) {
      pipes.out = endpoint.bEndpointAddress;
    } else {
      pipes.in = endpoint.bEndpointAddress;
      pipes.in_packet = endpoint.wMaxPacketSize;
    }
  }
  if (pipes.in == 0 || pipes.out == 0 || pipes.in_packet == 0) return std::nullopt;
  return pipes;
}

std::optional<Pipes> pipes_of(libusb_device* device) {
  libusb_config_descriptor* raw = nullptr;
  if (libusb_get_active_config_descriptor(device, &raw) != 0) return std::nullopt;
  const std::unique_ptr<libusb_config_descriptor, FreeConfig> config(raw);
  for (const auto& interface : std::span(config->interface, config->bNumInterfaces))
    if (interface.num_altsetting > 0)
      if (auto pipes = pipes_of(interface.altsetting[0])) return pipes;
  return std::nullopt;
}

/// "1-4.2", the name of the device in sysfs; "" for a root hub.
std::string port_of(libusb_device* device) {
  std::array<std::uint8_t, 8> ports{};
  const int count = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string text;
  for (int k = 0; k < count; ++k) text += fmt::format("{}{}", k == 0 ? "" : ".", ports[k]);
  return text.empty() ? text : fmt::format("{}-{}", libusb_get_bus_number(device), text);
}

/// A string that the kernel read when the device was connected. Needs no permission and does not disturb
/// other users of the device.
std::string kernel_text(const std::string& port, const char* what) {
  std::ifstream file(fmt::format("/sys/bus/usb/devices/{}/{}", port, what));
  std::string line;
  std::getline(file, line);
  return line;
}

UsbDevice about(libusb_device* device, const libusb_device_descriptor& descriptor) {
  const std::string port = port_of(device);
  const std::string node = fmt::format("/dev/bus/usb/{:03}/{:03}", libusb_get_bus_number(device),
                                       libusb_get_device_address(device));
  return {.vendor = descriptor.idVendor,
          .product_id = descriptor.idProduct,
          .maker = kernel_text(port, "manufacturer"),
          .product = kernel_text(port, "product"),
          .serial = kernel_text(port, "serial"),
          .port = port,
          .accessible = ::access(node.c_str(), R_OK | W_OK) == 0};
}

}  // namespace

Result<Context> make_context() {
  libusb_context* context = nullptr;
  if (const int code = libusb_init(&context); code != 0) return no_usb(code);
  return Context(context);
}

Result<std::vector<Candidate>> candidates(libusb_context& context) {
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(&context, &list);
  if (count < 0) return no_usb(static_cast<int>(count));
  std::vector<Candidate> found;
  for (libusb_device* one : std::span(list, static_cast<std::size_t>(count))) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(one, &descriptor) != 0) continue;
    if (const auto pipes = pipes_of(one))
      found.push_back({Device(libusb_ref_device(one)), *pipes, about(one, descriptor)});
  }
  libusb_free_device_list(list, 1);
  return found;
}

}  // namespace symrig::board::usb

namespace symrig {
namespace {

class SystemUsbBus final : public UsbBus {
 public:
  Result<std::vector<UsbDevice>> devices() override {
    SYMRIG_TRY(const auto context, board::usb::make_context());
    SYMRIG_TRY(const auto candidates, board::usb::candidates(*context));
    std::vector<UsbDevice> devices;
    devices.reserve(candidates.size());
    for (const board::usb::Candidate& one : candidates) devices.push_back(one.about);
    return devices;
  }
};

}  // namespace

std::unique_ptr<UsbBus> system_usb_bus() {
  return std::make_unique<SystemUsbBus>();
}

}  // namespace symrig

namespace symrig::board {
namespace {

using namespace std::chrono_literals;
constexpr std::size_t kReads = 16;    // packets that the kernel accepts from the board between two receive()
constexpr std::size_t kWrites = 8;    // frames in flight to the board
constexpr std::size_t kPiece = 1024;  // longer than any frame on the wire
constexpr Nanoseconds kUsbSendPatience = 2s;

struct FreeTransfer {
  void operator()(libusb_transfer* transfer) const { libusb_free_transfer(transfer); }
};
using Transfer = std::unique_ptr<libusb_transfer, FreeTransfer>;

/// Bulk pipes with several transfers in flight. The calling thread handles them: no thread of its own is
/// needed, because the kernel continues all submitted transfers. Each read is one packet long. A longer read
/// ends only with a short packet, and a frame may consist of full packets.
class UsbLink final : public Link {
 public:
  UsbLink(usb::Context context, usb::Handle handle, usb::Pipes pipes, std::string name)
      : context_(std::move(context)), handle_(std::move(handle)), pipes_(pipes), name_(std::move(name)) {}
  UsbLink(const UsbLink&) = delete;
  UsbLink& operator=(const UsbLink&) = delete;
  ~UsbLink() override;

  Result<void> begin();
  Result<void> send(std::span<const std::uint8_t> bytes) override;
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override;
  Nanoseconds now() const override { return steady_now() - opened_; }
  SteadyTime opened() const override { return {opened_}; }

 private:
  struct Slot {
    Transfer transfer;
    std::vector<std::uint8_t> buffer;
    bool busy = false;
    UsbLink* link = nullptr;
  };

  static void LIBUSB_CALL on_read(libusb_transfer* transfer);
  static void LIBUSB_CALL on_written(libusb_transfer* transfer);
  bool prepare(Slot& slot, std::uint8_t endpoint, std::size_t size, libusb_transfer_cb_fn done);
  bool submit(Slot& slot);
  void settle(Slot& slot);
  bool any_busy() const;
  Slot* free_write();
  Result<Slot*> wait_for_write();
  void run_events(Nanoseconds timeout);
  Error lost() const;

  usb::Context context_;
  usb::Handle handle_;
  usb::Pipes pipes_;
  std::string name_;
  Nanoseconds opened_ = steady_now();
  std::array<Slot, kReads> reads_;
  std::array<Slot, kWrites> writes_;
  std::vector<std::uint8_t> received_;
  bool gone_ = false;
  bool closing_ = false;  ///< reads are not submitted again
};

Error UsbLink::lost() const {
  return {ErrorCode::device_lost, fmt::format("{}: the board was unplugged or restarted", name_),
          "check its cable and supply, then connect again"};
}

bool UsbLink::prepare(Slot& slot, std::uint8_t endpoint, std::size_t size, libusb_transfer_cb_fn done) {
  slot.transfer.reset(libusb_alloc_transfer(0));
  if (!slot.transfer) return false;
  slot.buffer.resize(size);
  slot.link = this;
  libusb_fill_bulk_transfer(slot.transfer.get(), handle_.get(), endpoint, slot.buffer.data(),
                            static_cast<int>(size), done, &slot, 0);
  return true;
}

bool UsbLink::submit(Slot& slot) {
  slot.busy = libusb_submit_transfer(slot.transfer.get()) == 0;
  gone_ = gone_ || !slot.busy;
  return slot.busy;
}

/// Handles the end of a transfer. An error means that the board is gone, unless we cancelled the transfer.
void UsbLink::settle(Slot& slot) {
  slot.busy = false;
  const libusb_transfer_status status = slot.transfer->status;
  gone_ = gone_ || (status != LIBUSB_TRANSFER_COMPLETED && status != LIBUSB_TRANSFER_CANCELLED);
}

void LIBUSB_CALL UsbLink::on_read(libusb_transfer* transfer) {
  Slot& slot = *static_cast<Slot*>(transfer->user_data);
  UsbLink& link = *slot.link;
  link.settle(slot);
  if (transfer->status != LIBUSB_TRANSFER_COMPLETED) return;
  const auto begin = slot.buffer.begin();
  link.received_.insert(link.received_.end(), begin, begin + transfer->actual_length);
  if (!link.closing_) link.submit(slot);
}

void LIBUSB_CALL UsbLink::on_written(libusb_transfer* transfer) {
  Slot& slot = *static_cast<Slot*>(transfer->user_data);
  slot.link->settle(slot);
}

Result<void> UsbLink::begin() {
  bool sound = true;
  for (Slot& slot : writes_) sound = sound && prepare(slot, pipes_.out, kPiece, on_written);
  for (Slot& slot : reads_)
    sound = sound && prepare(slot, pipes_.in, pipes_.in_packet, on_read) && submit(slot);
  if (!sound) return lost();
  return {};
}

void UsbLink::run_events(Nanoseconds timeout) {
  const auto microseconds = std::chrono::ceil<std::chrono::microseconds>(std::max(timeout, Nanoseconds{0}));
  timeval left{static_cast<time_t>(microseconds.count() / 1'000'000),
               static_cast<suseconds_t>(microseconds.count() % 1'000'000)};
  const int code = libusb_handle_events_timeout_completed(context_.get(), &left, nullptr);
  gone_ = gone_ || (code != 0 && code != LIBUSB_ERROR_INTERRUPTED);
}

UsbLink::Slot* UsbLink::free_write() {
  auto* const slot = std::find_if(writes_.begin(), writes_.end(), [](const Slot& one) { return !one.busy; });
  return slot == writes_.end() ? nullptr : slot;
}

Result<UsbLink::Slot*> UsbLink::wait_for_write() {
  const Deadline deadline(kUsbSendPatience);
  while (!gone_) {
    if (Slot* slot = free_write()) return slot;
    if (deadline.passed())
      return Error{ErrorCode::device_lost,
                   fmt::format("{}: accepts no bytes for {:.3g} s", name_, seconds(kUsbSendPatience)),
                   "unplug the board and plug it in again"};
    run_events(deadline.left());
  }
  return lost();
}

Result<void> UsbLink::send(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    SYMRIG_TRY(Slot* const slot, wait_for_write());
    const std::size_t size = std::min(bytes.size(), kPiece);
    std::copy_n(bytes.begin(), size, slot->buffer.begin());
    slot->transfer->length = static_cast<int>(size);
    if (!submit(*slot)) return lost();
    bytes = bytes.subspan(size);
  }
  return {};
}

Result<std::vector<std::uint8_t>> UsbLink::receive(Nanoseconds timeout) {
  const Deadline deadline(timeout);
  while (received_.empty() && !gone_) {
    const Nanoseconds left = deadline.left();
    run_events(left);
    if (left.count() == 0) break;
  }
  if (received_.empty() && gone_) return lost();
  return std::exchange(received_, {});
}

bool UsbLink::any_busy() const {
  const auto busy = [](const Slot& slot) { return slot.busy; };
  return std::any_of(reads_.begin(), reads_.end(), busy) || std::any_of(writes_.begin(), writes_.end(), busy);
}

/// First gives frames in flight some time to leave: one may be an abort. Then cancels all transfers, because
/// a transfer in flight must not be freed. A board that sends all the time completes reads before they are
/// cancelled.
UsbLink::~UsbLink() {
  const Deadline flushed(100ms);
  const auto busy = [](const Slot& slot) { return slot.busy; };
  while (!gone_ && !flushed.passed() && std::any_of(writes_.begin(), writes_.end(), busy))
    run_events(flushed.left());
  closing_ = true;
  for (Slot& slot : reads_)
    if (slot.busy) libusb_cancel_transfer(slot.transfer.get());
  for (Slot& slot : writes_)
    if (slot.busy) libusb_cancel_transfer(slot.transfer.get());
  const Deadline deadline(1s);
  while (any_busy() && !deadline.passed()) run_events(10ms);
  libusb_release_interface(handle_.get(), pipes_.interface);
}

Error cannot_open_usb(const std::string& name, int code) {
  std::string hint = "unplug it and plug it in again";
  if (code == LIBUSB_ERROR_ACCESS) hint = "install the udev rule (docs/howto-boards.md) and plug it in again";
  if (code == LIBUSB_ERROR_BUSY) hint = "end the other program that uses the board";
  return {ErrorCode::device_lost, fmt::format("{} cannot be opened ({})", name, libusb_strerror(code)), hint};
}

/// The only candidate that matches the serial number.
Result<usb::Candidate> pick(std::vector<usb::Candidate> candidates, const std::string& serial) {
  std::vector<FoundBoard> found;
  std::erase_if(candidates, [](const usb::Candidate& one) { return !is_symrig(one.about); });
  found.reserve(candidates.size());
  for (const usb::Candidate& one : candidates) found.push_back(as_board(one.about));
  SYMRIG_TRY(const DeviceUri chosen, choose_board(found, serial));
  const auto same = [&](const usb::Candidate& one) { return one.about.serial == chosen.place; };
  return std::move(*std::find_if(candidates.begin(), candidates.end(), same));
}

}  // namespace

Result<std::unique_ptr<Link>> open_usb(const std::string& serial) {
  SYMRIG_TRY(auto context, usb::make_context());
  SYMRIG_TRY(auto candidates, usb::candidates(*context));
  SYMRIG_TRY(const auto chosen, pick(std::move(candidates), serial));
  const std::string name = "usb:" + chosen.about.serial;
  libusb_device_handle* raw = nullptr;
  if (const int code = libusb_open(chosen.device.get(), &raw); code != 0) return cannot_open_usb(name, code);
  usb::Handle handle(raw);
  if (const int code = libusb_claim_interface(raw, chosen.pipes.interface); code != 0)
    return cannot_open_usb(name, code);
  auto link = std::make_unique<UsbLink>(std::move(context), std::move(handle), chosen.pipes, name);
  SYMRIG_CHECK(link->begin());
  return std::unique_ptr<Link>(std::move(link));
}

}  // namespace symrig::board
