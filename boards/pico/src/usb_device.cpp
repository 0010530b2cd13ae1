// SPDX-License-Identifier: Apache-2.0
#include "usb_device.hpp"

#include "board_pins.hpp"
#include "registers.hpp"

namespace symrig::pico {

namespace desc = usb_descriptors;

void UsbDevice::begin(const char* serial) {
  serial_ = serial;
  for (uint32_t at = 0; at < 0x1000; at += 4) reg(usb::ram + at) = 0;
  reg(usb::muxing) = 9;            // to the PHY, soft connect
  reg(usb::power) = 0xc;           // VBUS is not wired to the controller; watch_vbus() looks for it
  reg(usb::main_ctrl) = 1;         // on, device
  reg(usb::sie_ctrl) = 1U << 29U;  // interrupt for each buffer of endpoint 0
  reg(usb::inte) =
      usb::kIntBuffer | usb::kIntReset | usb::kIntSuspend | usb::kIntResume | usb::kIntSetup | usb::kIntFrame;
  enable_irq(irq::usb, 2);
  reg(pads::pin(kVbusPin)) = pads::input_enable | pads::pull_down | pads::schmitt;
  reg(io::ctrl(kVbusPin)) = io::function_sio;
}

void UsbDevice::begin_round(bool in_run) {
  round_left_ = in_run ? kPerRoundInRun : kPerRound;
  packets_left_ = kPacketsPerRound;
  watch_vbus();
}

/// The pull-up must not feed a host that has no power. A cable that is pulled out is a link that is lost,
/// which the host's silence would show only after 3 ms.
void UsbDevice::watch_vbus() {
  constexpr uint32_t kGlitch = 200;  // us
  const uint32_t now = reg(timer::raw_low);
  const bool high = ((reg(sio::gpio_in) >> kVbusPin) & 1U) != 0;
  if (high) vbus_seen_ = now;
  const bool present = high || (pulled_up_ && now - vbus_seen_ < kGlitch);
  if (present == pulled_up_) return;
  const IrqHold hold(irq::usb);
  pulled_up_ = present;
  reg(usb::sie_ctrl + (present ? kSet : kClear)) = usb::kPullUp;
  if (!present) bus_reset();
}

// Called by the main loop.

SYMRIG_RAM size_t UsbDevice::read(uint8_t* out, size_t room) {
  if (forget_) {
    forget_ = false;
    from_host_.drop_to(forget_to_);
  }
  release_engine();
  size_t count = from_host_.used();
  if (count > room) count = room;
  if (count > round_left_) count = round_left_;
  for (size_t i = 0; i < count; ++i) out[i] = from_host_.take();
  round_left_ -= count;
  if (!listening_) {
    const IrqHold hold(irq::usb);
    listen();
  }
  return count;
}

/// After an urgent Abort, the engine stays at its safe levels until the firmware has handled all that came
/// before it: bytes of an earlier read() are handled when read() is called again.
SYMRIG_RAM void UsbDevice::release_engine() {
  const IrqHold hold(irq::usb);
  if (!holding_ || !from_host_.taken_up_to(abort_end_)) return;
  holding_ = false;
  engine_.release();
}

size_t UsbDevice::room() const {
  return attached() ? to_host_.room() : 0;
}

SYMRIG_RAM void UsbDevice::write(const uint8_t* bytes, size_t size) {
  for (size_t i = 0; i < size; ++i) to_host_.put(bytes[i]);
  const IrqHold hold(irq::usb);
  send_wire();
}

size_t UsbDevice::print(const char* text, size_t size) {
  size_t count = 0;
  for (; count < size && log_.room() > 0; ++count) log_.put(static_cast<uint8_t>(text[count]));
  const IrqHold hold(irq::usb);
  send_log();
  return count;
}

// Called by the interrupt.

SYMRIG_RAM void UsbDevice::handle() {
  const uint32_t status = reg(usb::ints);
  if ((status & usb::kIntFrame) != 0) frame_begins();
  if ((status & usb::kIntReset) != 0) {
    reg(usb::sie_status) = usb::kSieReset;
    bus_reset();
  }
  if ((status & usb::kIntSuspend) != 0) {
    reg(usb::sie_status) = usb::kSieSuspended;
    suspended_ = true;
  }
  if ((status & usb::kIntResume) != 0) {
    reg(usb::sie_status) = usb::kSieResume;
    suspended_ = false;
  }
  if ((status & usb::kIntSetup) != 0) {  // first: it ends whatever endpoint 0 was doing
    reg(usb::sie_status) = usb::kSieSetup;
    suspended_ = false;
    forget_control();
    setup();
  }
  if ((status & usb::kIntBuffer) != 0) {
    const uint32_t done = reg(usb::buff_status);
    reg(usb::buff_status) = done;
    suspended_ = false;  // traffic shows that the bus is not suspended
    buffers_done(done);
  }
}

void UsbDevice::bus_reset() {
  reg(usb::addr_endp) = 0;
  suspended_ = false;
  forget_control();
  configure(0);
}

/// A host may give up a control transfer in any stage. What it left in the buffers of endpoint 0 must not
/// answer the next one.
void UsbDevice::forget_control() {
  constexpr uint32_t kIn = usb::buff_status_bit(0, false);
  constexpr uint32_t kBoth = kIn | usb::buff_status_bit(0, true);
  take_back(kBoth);
  const uint32_t done = reg(usb::buff_status) & kBoth;
  reg(usb::buff_status) = done;
  if ((done & kIn) != 0) use_new_address();
  stage_ = Stage::none;
  address_new_ = false;
}

/// RP2040-E15: on some hubs, a bulk IN packet at the end of a frame can stop the controller. None is given to
/// it in the last fifth of a frame; the next frame sends it.
SYMRIG_RAM bool UsbDevice::frame_ends() const {
  constexpr uint32_t kBegin =
      760;  // us from the begin of a frame; 40 less, because its interrupt can be late
  constexpr uint32_t kEnd = 998;
  const uint32_t age = reg(timer::raw_low) - frame_at_;
  return age >= kBegin && age <= kEnd;
}

SYMRIG_RAM void UsbDevice::frame_begins() {
  frame_at_ = reg(timer::raw_low);
  [[maybe_unused]] const uint32_t number = reg(usb::frame);  // reading it clears the interrupt
  send_wire();
  send_log();
}

/// Resets endpoints and toggles. Discards bytes of an earlier connection.
void UsbDevice::configure(uint8_t value) {
  configured_ = false;
  configuration_ = value;
  console_open_ = false;
  listening_ = sending_ = sending_log_ = false;
  zero_owed_ = log_zero_owed_ = false;
  urgent_.restart();
  forget_to_ = from_host_.mark();
  forget_ = true;
  to_host_.clear();
  constexpr uint32_t kOfEndpoint0 = 3;
  take_back(((1U << (2 * kEndpoints)) - 1) & ~kOfEndpoint0);
  for (uint32_t endpoint = 1; endpoint < kEndpoints; ++endpoint) {
    for (uint32_t side = 0; side < 2; ++side) {
      const bool out = side == 1;
      toggle_[endpoint][out ? 1 : 0] = false;
      const uint32_t type = endpoint == desc::kNotice ? 3U : 2U;
      const bool used = value != 0 && !(endpoint == desc::kNotice && out);
      usb::endpoint_control(endpoint, out) =
          used ? (1U << 31U) | (1U << 29U) | (type << 26U) | usb::buffer(endpoint, out) : 0;
    }
  }
  if (value == 0) return;
  configured_ = true;
  listen();
  arm(desc::kConsole, true, kPacket);
  send_log();
}

/// Gives an endpoint's buffer to the controller. Writes the control word first. Sets its "available" bit only
/// after the word has reached the other clock domain.
SYMRIG_RAM void UsbDevice::arm(uint32_t endpoint, bool out, uint32_t size) {
  bool& toggle = toggle_[endpoint][out ? 1 : 0];
  const uint32_t word = size | usb::kLast | (toggle ? usb::kData1 : 0) | (out ? 0 : usb::kFull);
  toggle = !toggle;
  usb::buffer_control(endpoint, out) = word;
  asm volatile("nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop");
  usb::buffer_control(endpoint, out) = word | usb::kAvailable;
}

/// Takes buffers from the controller (bits as buff_status_bit()). It may be in the middle of a packet with
/// one of them. So it is asked first, and answers when it has ended the packet. It may not answer on chips
/// before B2 (RP2040-E2): after the time of a packet its buffers are taken anyway.
SYMRIG_RAM void UsbDevice::take_back(uint32_t buffers) {
  constexpr uint32_t kPacketTime = 60;  // us: 64 bytes with their frame, 12 Mbit/s
  uint32_t owned = 0;
  for (uint32_t bit = 0; bit < 2 * kEndpoints; ++bit) {
    const bool available = (usb::buffer_control(bit / 2, bit % 2 != 0) & usb::kAvailable) != 0;
    if (((buffers >> bit) & 1U) != 0 && available) owned |= 1U << bit;
  }
  const uint32_t begin = reg(timer::raw_low);
  reg(usb::ep_abort + kSet) = owned;
  while ((reg(usb::ep_abort_done) & owned) != owned && reg(timer::raw_low) - begin <= kPacketTime) {
  }
  for (uint32_t bit = 0; bit < 2 * kEndpoints; ++bit)
    if (((buffers >> bit) & 1U) != 0) usb::buffer_control(bit / 2, bit % 2 != 0) = 0;
  reg(usb::ep_abort + kClear) = owned;
  reg(usb::ep_abort_done) = owned;
}

SYMRIG_RAM void UsbDevice::buffers_done(uint32_t done) {
  if ((done & usb::buff_status_bit(0, false)) != 0) control_in_done();
  if ((done & usb::buff_status_bit(0, true)) != 0) control_out_done();
  if ((done & usb::buff_status_bit(desc::kWire, true)) != 0) take_packet();
  if ((done & usb::buff_status_bit(desc::kWire, false)) != 0) {
    sending_ = false;
    send_wire();
  }
  if ((done & usb::buff_status_bit(desc::kConsole, true)) != 0)
    arm(desc::kConsole, true, kPacket);  // data from the host to the console are ignored
  if ((done & usb::buff_status_bit(desc::kConsole, false)) != 0) {
    sending_log_ = false;
    send_log();
  }
}

/// Accepts another packet from the host as soon as a full packet fits. Until then the host has to wait.
SYMRIG_RAM void UsbDevice::listen() {
  if (!configured_ || listening_ || packets_left_ == 0 || from_host_.room() < kPacket) return;
  --packets_left_;
  listening_ = true;
  arm(desc::kWire, true, kPacket);
}

SYMRIG_RAM void UsbDevice::take_packet() {
  const uint32_t size = usb::buffer_control(desc::kWire, true) & usb::kLengthMask;
  const uint32_t from = usb::ram + usb::buffer(desc::kWire, true);
  for (uint32_t i = 0; i < size; i += 4) {
    uint32_t word = reg(from + i);
    for (uint32_t k = i; k < size && k < i + 4; ++k, word >>= 8U) {
      const auto byte = static_cast<uint8_t>(word);
      const bool abort = urgent_.push(byte);
      if (abort) engine_.fall();
      from_host_.put(byte);
      if (!abort) continue;
      holding_ = true;
      abort_end_ = from_host_.mark();
    }
  }
  listening_ = false;
  listen();
}

/// false: there is nothing to send.
template <size_t kSize>
SYMRIG_RAM bool UsbDevice::send_packet(uint32_t endpoint, ByteRing<kSize>& ring, bool& zero_owed) {
  size_t size = ring.used();
  if ((size == 0 && !zero_owed) || frame_ends()) return false;
  if (size > kPacket) size = kPacket;
  const uint32_t to = usb::ram + usb::buffer(endpoint, false);
  for (size_t i = 0; i < size; i += 4) {
    uint32_t word = 0;
    for (size_t k = 0; k < 4 && i + k < size; ++k) word |= static_cast<uint32_t>(ring.take()) << (8 * k);
    reg(static_cast<uint32_t>(to + i)) = word;
  }
  zero_owed = size == kPacket;
  arm(endpoint, false, static_cast<uint32_t>(size));
  return true;
}

SYMRIG_RAM void UsbDevice::send_wire() {
  if (configured_ && !sending_) sending_ = send_packet(desc::kWire, to_host_, zero_owed_);
}

SYMRIG_RAM void UsbDevice::send_log() {
  if (console_open() && !sending_log_) sending_log_ = send_packet(desc::kConsole, log_, log_zero_owed_);
}

}  // namespace symrig::pico
