// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "edge_engine.hpp"
#include "registers.hpp"
#include "symrig/firmware/core.hpp"
#include "symrig/firmware/link.hpp"
#include "symrig/hal/peripherals.hpp"

#include <stddef.h>  // NOLINT(modernize-deprecated-headers)
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

/// The device's descriptors: a vendor interface (bulk, the wire), a CDC-ACM console (the log), and Microsoft
/// OS 2.0 descriptors that select the WinUSB driver for the vendor interface.
namespace symrig::pico::usb_descriptors {

/// Endpoints.
constexpr uint8_t kWire = 1;     // bulk, both ways
constexpr uint8_t kNotice = 2;   // interrupt, to the host: never used, but CDC requires it
constexpr uint8_t kConsole = 3;  // bulk, both ways
constexpr uint8_t kResetInterface = 3;
constexpr uint8_t kMsVendorCode = 0x20;  // bRequest for the Microsoft descriptors

/// Bytes with static lifetime.
struct Bytes {
  const uint8_t* data = nullptr;
  uint16_t size = 0;
};

Bytes device();
Bytes configuration();
Bytes bos();
Bytes microsoft();
/// A string as ASCII; nullptr if there is none with this number. serial: the text of string 3.
const char* string(uint8_t number, const char* serial);

}  // namespace symrig::pico::usb_descriptors

namespace symrig::pico {

/// Bytes between an interrupt and the main loop: one side writes, the other reads. The size is a power of
/// two.
template <size_t kSize>
class ByteRing {
  static_assert((kSize & (kSize - 1)) == 0);

 public:
  size_t used() const { return put_ - taken_; }
  size_t room() const { return kSize - used(); }
  void put(uint8_t byte) {
    bytes_[put_ % kSize] = byte;
    put_ = put_ + 1;
  }
  uint8_t take() {
    const uint8_t byte = bytes_[taken_ % kSize];
    taken_ = taken_ + 1;
    return byte;
  }
  /// For the reader: discards everything.
  void clear() { taken_ = put_; }
  /// For the writer: a position for drop_to().
  size_t mark() const { return put_; }
  /// For the reader: true if everything written before `mark` was taken.
  bool taken_up_to(size_t mark) const { return static_cast<ptrdiff_t>(taken_ - mark) >= 0; }
  /// For the reader: discards what was written before `mark`.
  void drop_to(size_t mark) {
    if (static_cast<ptrdiff_t>(mark - taken_) > 0) taken_ = mark;
  }

 private:
  uint8_t bytes_[kSize];
  volatile size_t put_ = 0;
  volatile size_t taken_ = 0;
};

/// The USB device: endpoint 0, the wire (hal::ByteLink) and the console's output. The interrupt does all the
/// work. The main loop exchanges data with it through byte rings.
/// docs/board-pico-debug.md, "USB and interrupts".
class UsbDevice final : public hal::ByteLink {
 public:
  /// The engine goes to its safe levels as soon as an urgent Abort arrives.
  explicit UsbDevice(PicoEngine& engine) : engine_(engine) {}

  /// serial must outlive the device. begin_round() then shows the board to a host as soon as there is one.
  void begin(const char* serial);

  size_t read(uint8_t* out, size_t room) override;
  size_t room() const override;
  void write(const uint8_t* bytes, size_t size) override;
  bool attached() const override { return configured_ && !suspended_; }

  /// Call it in every round of the main loop: looks for the cable. read() then gives a limited number of
  /// bytes; the rest waits for the next round.
  void begin_round(bool in_run);
  /// true: bytes are left for the next round.
  bool waiting() const { return from_host_.used() > 0; }

  /// Takes the part of a console text that fits. Returns its size.
  size_t print(const char* text, size_t size);
  enum class Reset : uint8_t { none, restart, bootloader };
  /// What a host has asked for through the reset interface.
  Reset reset_asked() const { return reset_due_ ? reset_ : Reset::none; }

  /// true: a terminal program has the console open.
  bool console_open() const { return configured_ && console_open_; }

  /// The interrupt handler.
  void handle();

 private:
  static constexpr size_t kPacket = 64;
  static constexpr size_t kPerRound = kPacket;
  // The shortest request. So at most one ends in a round; its cost is part of poll_ticks.
  static constexpr size_t kPerRoundInRun = 16;
  // Packets cost time when they arrive, too. A host that sends without pause must not take more than this.
  static constexpr uint32_t kPacketsPerRound = 4;
  static constexpr size_t kFromHost = 1024;
  static constexpr size_t kToHost = 1024;
  static constexpr size_t kLog = 1024;
  static constexpr uint32_t kEndpoints = 4;

  enum class Stage : uint8_t { none, data_in, data_out, status_in, status_out };

  void watch_vbus();
  void bus_reset();
  void configure(uint8_t value);
  // Endpoint 0
  void forget_control();
  void use_new_address();
  void setup();
  bool standard(uint8_t type, uint8_t request, uint16_t value, uint16_t length);
  bool class_or_vendor(uint8_t type, uint8_t request, uint16_t value, uint16_t index, uint16_t length);
  bool get_descriptor(uint16_t value, uint16_t length);
  bool endpoint_feature(uint8_t request, uint16_t index);
  void answer(const uint8_t* bytes, uint16_t size, uint16_t length);
  void answer_more();
  void acknowledge();
  void stall();
  void control_in_done();
  void control_out_done();
  // The other endpoints.
  void arm(uint32_t endpoint, bool out, uint32_t size);
  void take_back(uint32_t buffers);
  void buffers_done(uint32_t done);
  bool frame_ends() const;
  void frame_begins();
  void listen();
  void take_packet();
  void release_engine();
  template <size_t kSize>
  bool send_packet(uint32_t endpoint, ByteRing<kSize>& ring, bool& zero_owed);
  void send_wire();
  void send_log();

  PicoEngine& engine_;
  firmware::UrgentScan urgent_;
  const char* serial_ = "";
  ByteRing<kFromHost> from_host_;
  ByteRing<kToHost> to_host_;
  ByteRing<kLog> log_;
  size_t round_left_ = 0;
  volatile uint32_t packets_left_ = 0;

  bool pulled_up_ = false;
  uint32_t vbus_seen_ = 0;  // us
  uint32_t frame_at_ = 0;   // us
  volatile bool configured_ = false;
  volatile bool suspended_ = false;
  volatile bool console_open_ = false;
  volatile bool forget_ = false;  // bytes received up to forget_to_ are from an earlier connection
  volatile size_t forget_to_ = 0;
  bool holding_ = false;  // the engine waits for the firmware to read the bytes up to abort_end_
  size_t abort_end_ = 0;
  bool listening_ = false;  // the controller has the wire's OUT buffer
  bool sending_ = false;    // the controller has the wire's IN buffer
  bool sending_log_ = false;
  bool zero_owed_ = false;  // the last packet was full, so one more packet, maybe empty, must mark the end
  bool log_zero_owed_ = false;

  Reset reset_ = Reset::none;
  volatile bool reset_due_ = false;

  Stage stage_ = Stage::none;
  bool address_new_ = false;
  uint8_t address_ = 0;
  uint8_t configuration_ = 0;
  const uint8_t* answer_ = nullptr;
  uint16_t answer_left_ = 0;
  bool answer_zero_ = false;  // the answer ends with an empty packet
  bool toggle_[kEndpoints][2] = {};
  uint8_t scratch_[64] = {};
  uint8_t line_coding_[7] = {0x00, 0xc2, 0x01, 0x00, 0, 0, 8};  // 115200 8N1, if a host asks
};

/// The log on the USB serial port: the start, each change of state, each fault. Never waits. Characters that
/// do not fit are counted and reported later.
class Console {
 public:
  Console(UsbDevice& usb, const firmware::Core& core) : usb_(usb), core_(core) {}

  void greet(hal::ResetCause cause);
  /// Reports what has changed since the last call.
  void service();

 private:
  void line(const char* first, const char* second);
  void line(const char* text, uint64_t number);
  void print(const char* text);

  UsbDevice& usb_;
  const firmware::Core& core_;
  firmware::State told_state_ = firmware::State::boot;
  uint32_t told_fault_ = 0;
  uint32_t lost_ = 0;  // characters lost since the last report
};

}  // namespace symrig::pico
