// SPDX-License-Identifier: Apache-2.0
#include "usb_device.hpp"

#include "abort_scan.hpp"

namespace symrig::pico {

namespace desc = usb_descriptors;

namespace {

// Buffer control.
constexpr uint32_t kAvailable = 1U << 10U, kStall = 1U << 11U, kData1 = 1U << 13U, kLast = 1U << 14U,
                   kFull = 1U << 15U;
constexpr uint32_t kLengthMask = 0x3ff;
// SIE_STATUS and interrupts.
constexpr uint32_t kSieSuspended = 1U << 4U, kSieResume = 1U << 11U, kSieSetup = 1U << 17U,
                   kSieReset = 1U << 19U;
constexpr uint32_t kIntBuffer = 1U << 4U, kIntReset = 1U << 12U, kIntSuspend = 1U << 14U,
                   kIntResume = 1U << 15U, kIntSetup = 1U << 16U;

// The controller's memory: control words first, then a 64-byte buffer for each end of each endpoint.
constexpr uint32_t kControlBuffer = 0x100;
constexpr uint32_t buffer(uint32_t endpoint, bool out) {
  return endpoint == 0 ? kControlBuffer : 0x180 + 0x80 * (endpoint - 1) + (out ? 0x40 : 0);
}
volatile uint32_t& buffer_control(uint32_t endpoint, bool out) {
  return reg(usb::ram + 0x80 + 8 * endpoint + (out ? 4 : 0));
}
volatile uint32_t& endpoint_control(uint32_t endpoint, bool out) {
  return reg(usb::ram + 8 * endpoint + (out ? 4 : 0));
}
constexpr uint32_t buff_status_bit(uint32_t endpoint, bool out) {
  return 1U << (2 * endpoint + (out ? 1 : 0));
}

uint8_t memory_byte(uint32_t at) {
  return static_cast<uint8_t>(reg(usb::ram + (at & ~3U)) >> (8 * (at & 3U)));
}

constexpr uint8_t kInDirection = 0x80;
constexpr uint8_t kTypeMask = 0x60;
constexpr uint8_t kStandard = 0;

}  // namespace

void UsbDevice::begin(const char* serial) {
  serial_ = serial;
  for (uint32_t at = 0; at < 0x1000; at += 4) reg(usb::ram + at) = 0;
  reg(usb::muxing) = 9;            // to the PHY, soft connect
  reg(usb::power) = 0xc;           // VBUS is taken to be there
  reg(usb::main_ctrl) = 1;         // on, device
  reg(usb::sie_ctrl) = 1U << 29U;  // tell of each buffer of endpoint 0
  reg(usb::inte) = kIntBuffer | kIntReset | kIntSuspend | kIntResume | kIntSetup;
  enable_irq(irq::usb, 2);
  reg(usb::sie_ctrl + kSet) = 1U << 16U;  // pull-up
}

// ------------------------------------------------------------------------------------------- the main loop's
// side

SYMRIG_RAM size_t UsbDevice::read(uint8_t* out, size_t room) {
  if (forget_) {
    forget_ = false;
    from_host_.drop_to(forget_to_);
  }
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

// ------------------------------------------------------------------------------------------------ the
// interrupt

SYMRIG_RAM void UsbDevice::handle() {
  const uint32_t status = reg(usb::ints);
  if ((status & kIntReset) != 0) {
    reg(usb::sie_status) = kSieReset;
    bus_reset();
  }
  if ((status & kIntSuspend) != 0) {
    reg(usb::sie_status) = kSieSuspended;
    suspended_ = true;
  }
  if ((status & kIntResume) != 0) {
    reg(usb::sie_status) = kSieResume;
    suspended_ = false;
  }
  if ((status & kIntBuffer) != 0) {
    const uint32_t done = reg(usb::buff_status);
    reg(usb::buff_status) = done;
    suspended_ = false;  // whoever speaks is not suspended
    buffers_done(done);
  }
  if ((status & kIntSetup) != 0) {
    reg(usb::sie_status) = kSieSetup;
    suspended_ = false;
    setup();
  }
}

void UsbDevice::bus_reset() {
  reg(usb::addr_endp) = 0;
  stage_ = Stage::none;
  address_new_ = false;
  suspended_ = false;
  configure(0);
}

/// Ends and toggles start afresh; bytes of an earlier session are forgotten.
void UsbDevice::configure(uint8_t value) {
  configured_ = false;
  configuration_ = value;
  console_open_ = false;
  listening_ = sending_ = sending_log_ = false;
  zero_owed_ = log_zero_owed_ = false;
  forget_to_ = from_host_.mark();
  forget_ = true;
  to_host_.clear();
  for (uint32_t endpoint = 1; endpoint < kEndpoints; ++endpoint) {
    for (uint32_t side = 0; side < 2; ++side) {
      const bool out = side == 1;
      toggle_[endpoint][out ? 1 : 0] = false;
      buffer_control(endpoint, out) = 0;
      const uint32_t type = endpoint == desc::kNotice ? 3U : 2U;
      const bool used = value != 0 && !(endpoint == desc::kNotice && out);
      endpoint_control(endpoint, out) =
          used ? (1U << 31U) | (1U << 29U) | (type << 26U) | buffer(endpoint, out) : 0;
    }
  }
  if (value == 0) return;
  configured_ = true;
  listen();
  arm(desc::kConsole, true, kPacket);
  send_log();
}

/// Hands an endpoint's buffer to the controller: the word first, then, when it has surely arrived in the
/// other clock domain, the bit that makes it valid.
SYMRIG_RAM void UsbDevice::arm(uint32_t endpoint, bool out, uint32_t size) {
  bool& toggle = toggle_[endpoint][out ? 1 : 0];
  const uint32_t word = size | kLast | (toggle ? kData1 : 0) | (out ? 0 : kFull);
  toggle = !toggle;
  buffer_control(endpoint, out) = word;
  asm volatile("nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop");
  buffer_control(endpoint, out) = word | kAvailable;
}

SYMRIG_RAM void UsbDevice::buffers_done(uint32_t done) {
  if ((done & buff_status_bit(0, false)) != 0) control_in_done();
  if ((done & buff_status_bit(0, true)) != 0) control_out_done();
  if ((done & buff_status_bit(desc::kWire, true)) != 0) take_packet();
  if ((done & buff_status_bit(desc::kWire, false)) != 0) {
    sending_ = false;
    send_wire();
  }
  if ((done & buff_status_bit(desc::kConsole, true)) != 0)
    arm(desc::kConsole, true, kPacket);  // nobody reads it
  if ((done & buff_status_bit(desc::kConsole, false)) != 0) {
    sending_log_ = false;
    send_log();
  }
}

/// Takes another packet from the host as soon as a whole one fits; until then the host is told to wait.
SYMRIG_RAM void UsbDevice::listen() {
  if (!configured_ || listening_ || from_host_.room() < kPacket) return;
  listening_ = true;
  arm(desc::kWire, true, kPacket);
}

SYMRIG_RAM void UsbDevice::take_packet() {
  const uint32_t size = buffer_control(desc::kWire, true) & kLengthMask;
  const uint32_t from = usb::ram + buffer(desc::kWire, true);
  uint32_t words[kPacket / 4] = {};
  for (uint32_t i = 0; i < size; i += 4) words[i / 4] = reg(from + i);
  const auto* bytes = reinterpret_cast<const uint8_t*>(words);
  if (ends_with_abort(bytes, size)) engine_.fall();
  for (uint32_t i = 0; i < size; ++i) from_host_.put(bytes[i]);
  listening_ = false;
  listen();
}

/// false: there is nothing to send.
template <size_t kSize>
SYMRIG_RAM bool UsbDevice::send_packet(uint32_t endpoint, ByteRing<kSize>& ring, bool& zero_owed) {
  size_t size = ring.used();
  if (size == 0 && !zero_owed) return false;
  if (size > kPacket) size = kPacket;
  const uint32_t to = usb::ram + buffer(endpoint, false);
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

// -------------------------------------------------------------------------------------------------- endpoint
// 0

void UsbDevice::setup() {
  const uint8_t type = memory_byte(0);
  const uint8_t request = memory_byte(1);
  const auto value = static_cast<uint16_t>(reg(usb::ram) >> 16U);
  const auto index = static_cast<uint16_t>(reg(usb::ram + 4));
  const auto length = static_cast<uint16_t>(reg(usb::ram + 4) >> 16U);
  toggle_[0][0] = toggle_[0][1] = true;  // data stages begin with DATA1
  address_new_ = false;
  bool known = false;
  if ((type & kTypeMask) != kStandard) {
    known = class_or_vendor(type, request, value, index, length);
  } else if (request == 1 || request == 3 || (type & 0x1fU) == 2) {
    known = endpoint_feature(request, index);
  } else {
    known = standard(type, request, value, length);
  }
  if (!known) stall();
}

bool UsbDevice::standard(uint8_t type, uint8_t request, uint16_t value, uint16_t length) {
  const bool in = (type & kInDirection) != 0;
  switch (request) {
    case 0:  // GET_STATUS
      scratch_[0] = scratch_[1] = 0;
      answer(scratch_, 2, length);
      return in;
    case 5:  // SET_ADDRESS: takes effect after the status stage
      address_ = static_cast<uint8_t>(value & 0x7fU);
      address_new_ = true;
      acknowledge();
      return true;
    case 6:
      return in && get_descriptor(value, length);
    case 8:  // GET_CONFIGURATION
      scratch_[0] = configuration_;
      answer(scratch_, 1, length);
      return in;
    case 9:  // SET_CONFIGURATION
      if (value > 1) return false;
      configure(static_cast<uint8_t>(value));
      acknowledge();
      return true;
    case 10:  // GET_INTERFACE: there are no alternatives
      scratch_[0] = 0;
      answer(scratch_, 1, length);
      return in;
    case 11:  // SET_INTERFACE
      if (value != 0) return false;
      acknowledge();
      return true;
    default:
      return false;
  }
}

/// SET_FEATURE and CLEAR_FEATURE of an endpoint: halts. Of the device: none.
bool UsbDevice::endpoint_feature(uint8_t request, uint16_t index) {
  const uint32_t endpoint = index & 0xfU;
  const bool out = (index & kInDirection) == 0;
  if (request == 0 && endpoint < kEndpoints) {
    scratch_[0] = (buffer_control(endpoint, out) & kStall) != 0 ? 1 : 0;
    scratch_[1] = 0;
    answer(scratch_, 2, 2);
    return true;
  }
  if (endpoint == 0 || endpoint >= kEndpoints || (request != 1 && request != 3)) return false;
  toggle_[endpoint][out ? 1 : 0] = false;
  buffer_control(endpoint, out) = request == 3 ? kStall : 0;
  if (request == 1 && endpoint == desc::kWire && out) listening_ = false, listen();
  if (request == 1 && endpoint == desc::kWire && !out) sending_ = false, send_wire();
  if (request == 1 && endpoint == desc::kConsole && out) arm(desc::kConsole, true, kPacket);
  if (request == 1 && endpoint == desc::kConsole && !out) sending_log_ = false, send_log();
  acknowledge();
  return true;
}

bool UsbDevice::class_or_vendor(uint8_t type, uint8_t request, uint16_t value, uint16_t index,
                                uint16_t length) {
  constexpr uint8_t kClassToInterface = 0x21;
  constexpr uint8_t kClassFromInterface = 0xa1;
  constexpr uint8_t kVendorFromDevice = 0xc0;
  if (type == kVendorFromDevice && request == desc::kMsVendorCode && index == 7) {
    answer(desc::microsoft().data, desc::microsoft().size, length);
    return true;
  }
  if (type == kClassFromInterface && request == 0x21) {  // GET_LINE_CODING
    answer(line_coding_, sizeof line_coding_, length);
    return true;
  }
  if (type == kClassToInterface && request == 0x20 && length == sizeof line_coding_) {  // SET_LINE_CODING
    stage_ = Stage::data_out;
    arm(0, true, kPacket);
    return true;
  }
  if (type == kClassToInterface && request == 0x22) {  // SET_CONTROL_LINE_STATE: bit 0 is "terminal ready"
    console_open_ = (value & 1U) != 0;
    acknowledge();
    send_log();
    return true;
  }
  return false;
}

bool UsbDevice::get_descriptor(uint16_t value, uint16_t length) {
  const auto number = static_cast<uint8_t>(value);
  desc::Bytes found;
  switch (value >> 8U) {
    case 1:
      found = desc::device();
      break;
    case 2:
      found = desc::configuration();
      break;
    case 15:
      found = desc::bos();
      break;
    case 3: {
      if (number == 0) {
        static constexpr uint8_t kLanguages[] = {4, 3, 0x09, 0x04};
        found = {kLanguages, sizeof kLanguages};
        break;
      }
      const char* text = desc::string(number, serial_);
      if (text == nullptr) return false;
      uint8_t size = 2;
      for (; *text != 0 && size + 2U <= sizeof scratch_; size += 2, ++text) {
        scratch_[size] = static_cast<uint8_t>(*text);
        scratch_[size + 1] = 0;
      }
      scratch_[0] = size;
      scratch_[1] = 3;
      found = {scratch_, size};
      break;
    }
    default:
      return false;
  }
  answer(found.data, found.size, length);
  return true;
}

void UsbDevice::answer(const uint8_t* bytes, uint16_t size, uint16_t length) {
  answer_ = bytes;
  answer_left_ = size < length ? size : length;
  answer_zero_ = size < length && size % kPacket == 0;
  stage_ = Stage::data_in;
  answer_more();
}

void UsbDevice::answer_more() {
  const uint32_t size = answer_left_ < kPacket ? answer_left_ : kPacket;
  for (uint32_t i = 0; i < size; i += 4) {
    uint32_t word = 0;
    for (uint32_t k = 0; k < 4 && i + k < size; ++k) word |= static_cast<uint32_t>(answer_[i + k]) << (8 * k);
    reg(usb::ram + kControlBuffer + i) = word;
  }
  answer_ += size;
  answer_left_ = static_cast<uint16_t>(answer_left_ - size);
  if (size < kPacket) answer_zero_ = false;
  arm(0, false, size);
}

/// The status stage of a request that brought no data to the host.
void UsbDevice::acknowledge() {
  stage_ = Stage::status_in;
  toggle_[0][0] = true;
  arm(0, false, 0);
}

void UsbDevice::stall() {
  stage_ = Stage::none;
  reg(usb::ep_stall_arm) = 3;
  buffer_control(0, false) = kStall;
  buffer_control(0, true) = kStall;
}

void UsbDevice::control_in_done() {
  if (address_new_) {
    reg(usb::addr_endp) = address_;
    address_new_ = false;
  }
  if (stage_ == Stage::data_in) {
    if (answer_left_ > 0 || answer_zero_) return answer_more();
    stage_ = Stage::status_out;
    toggle_[0][1] = true;
    return arm(0, true, 0);
  }
  stage_ = Stage::none;
}

void UsbDevice::control_out_done() {
  if (stage_ != Stage::data_out) {
    stage_ = Stage::none;
    return;
  }
  for (uint32_t i = 0; i < sizeof line_coding_; ++i) line_coding_[i] = memory_byte(kControlBuffer + i);
  acknowledge();
}

}  // namespace symrig::pico
