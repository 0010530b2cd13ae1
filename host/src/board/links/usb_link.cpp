// SPDX-License-Identifier: Apache-2.0
#include "board/links/links.hpp"
#include "board/links/usb.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>
#include <sys/time.h>

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
