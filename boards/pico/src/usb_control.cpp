// SPDX-License-Identifier: Apache-2.0
// Endpoint 0: descriptors, address, configuration, and the requests of CDC and Windows.
#include "registers.hpp"
#include "usb_device.hpp"

namespace symrig::pico {

namespace desc = usb_descriptors;

namespace {

uint8_t memory_byte(uint32_t at) {
  return static_cast<uint8_t>(reg(usb::ram + (at & ~3U)) >> (8 * (at & 3U)));
}

constexpr uint8_t kInDirection = 0x80;
constexpr uint8_t kTypeMask = 0x60;
constexpr uint8_t kStandard = 0;

}  // namespace

void UsbDevice::setup() {
  const uint8_t type = memory_byte(0);
  const uint8_t request = memory_byte(1);
  const auto value = static_cast<uint16_t>(reg(usb::ram) >> 16U);
  const auto index = static_cast<uint16_t>(reg(usb::ram + 4));
  const auto length = static_cast<uint16_t>(reg(usb::ram + 4) >> 16U);
  toggle_[0][0] = toggle_[0][1] = true;  // data stages begin with DATA1
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
  const bool to_device = type == 0 && length == 0;
  const bool to_interface = type == 1 && length == 0;
  switch (request) {
    case 0:  // GET_STATUS
      if (!in) return false;
      scratch_[0] = scratch_[1] = 0;
      answer(scratch_, 2, length);
      return true;
    case 5:  // SET_ADDRESS: takes effect after the status stage
      if (!to_device) return false;
      address_ = static_cast<uint8_t>(value & 0x7fU);
      address_new_ = true;
      acknowledge();
      return true;
    case 6:
      return in && get_descriptor(value, length);
    case 8:  // GET_CONFIGURATION
      if (!in) return false;
      scratch_[0] = configuration_;
      answer(scratch_, 1, length);
      return true;
    case 9:  // SET_CONFIGURATION
      if (value > 1 || !to_device) return false;
      configure(static_cast<uint8_t>(value));
      acknowledge();
      return true;
    case 10:  // GET_INTERFACE: there are no alternatives
      if (!in) return false;
      scratch_[0] = 0;
      answer(scratch_, 1, length);
      return true;
    case 11:  // SET_INTERFACE
      if (value != 0 || !to_interface) return false;
      acknowledge();
      return true;
    default:
      return false;
  }
}

/// SET_FEATURE and CLEAR_FEATURE: only the halt feature of an endpoint, none of the device.
bool UsbDevice::endpoint_feature(uint8_t request, uint16_t index) {
  const uint32_t endpoint = index & 0xfU;
  const bool out = (index & kInDirection) == 0;
  if (request == 0 && endpoint < kEndpoints) {
    scratch_[0] = (usb::buffer_control(endpoint, out) & usb::kStall) != 0 ? 1 : 0;
    scratch_[1] = 0;
    answer(scratch_, 2, 2);
    return true;
  }
  if (endpoint == 0 || endpoint >= kEndpoints || (request != 1 && request != 3)) return false;
  toggle_[endpoint][out ? 1 : 0] = false;
  take_back(usb::buff_status_bit(endpoint, out));
  if (request == 3) usb::buffer_control(endpoint, out) = usb::kStall;
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
  // picotool: 1 = into the boot loader, 2 = start again (pico-sdk, pico_stdio_usb reset interface)
  if (type == kClassToInterface && index == desc::kResetInterface) {
    if ((request != 1 && request != 2) || length != 0) return false;
    reset_ = request == 1 ? Reset::bootloader : Reset::restart;
    acknowledge();
    return true;
  }
  if (type == kClassToInterface && request == 0x22 &&
      length == 0) {  // SET_CONTROL_LINE_STATE: bit 0 is "terminal ready"
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
    reg(usb::ram + usb::kControlBuffer + i) = word;
  }
  answer_ += size;
  answer_left_ = static_cast<uint16_t>(answer_left_ - size);
  if (size < kPacket) answer_zero_ = false;
  arm(0, false, size);
}

/// The status stage of a request without data to the host.
void UsbDevice::acknowledge() {
  stage_ = Stage::status_in;
  toggle_[0][0] = true;
  arm(0, false, 0);
}

void UsbDevice::stall() {
  stage_ = Stage::none;
  reg(usb::ep_stall_arm) = 3;
  usb::buffer_control(0, false) = usb::kStall;
  usb::buffer_control(0, true) = usb::kStall;
}

void UsbDevice::use_new_address() {
  if (!address_new_) return;
  reg(usb::addr_endp) = address_;
  address_new_ = false;
}

void UsbDevice::control_in_done() {
  use_new_address();
  if (stage_ == Stage::data_in) {
    if (answer_left_ > 0 || answer_zero_) return answer_more();
    stage_ = Stage::status_out;
    toggle_[0][1] = true;
    return arm(0, true, 0);
  }
  stage_ = Stage::none;
  if (reset_ != Reset::none) reset_due_ = true;  // the host has its answer
}

void UsbDevice::control_out_done() {
  if (stage_ != Stage::data_out) {
    stage_ = Stage::none;
    return;
  }
  for (uint32_t i = 0; i < sizeof line_coding_; ++i) line_coding_[i] = memory_byte(usb::kControlBuffer + i);
  acknowledge();
}

}  // namespace symrig::pico
