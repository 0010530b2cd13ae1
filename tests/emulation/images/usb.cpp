// SPDX-License-Identifier: Apache-2.0
// A composite USB device for the tests: interface 0 is a vendor one (endpoint 1 echoes, endpoint 4 is a
// double-buffered sink), interfaces 1 and 2 are a CDC ACM port (endpoint 2 notices, endpoint 3 echoes in
// capitals). Vendor requests make it misbehave.
#include "rp2040.hpp"

// Descriptors of the test device (USB 2.0, 9.6; CDC 1.2; Microsoft OS 2.0).
namespace descriptors {

using rp::u8;

constexpr u8 kDevice[] = {18, 1, 0x10, 0x02, 0xef, 2, 1, 64, 0x09, 0x12, 0x01, 0x00, 0x00, 0x01, 1, 2, 3, 1};

constexpr u8 kConfiguration[] = {
    9,  2,    105,  0,    3,    1, 0,    0x80, 50, 9,    4, 0,    0, 3,  0xff, 0,    0,    0,  // vendor
    7,  5,    0x01, 2,    64,   0, 0,    7,    5,  0x81, 2, 64,   0, 0,  7,    5,    0x04, 2,
    64, 0,    0,    8,    11,   1, 2,    2,    2,  0,    0,  // interfaces 1 and 2 belong together
    9,  4,    1,    0,    1,    2, 2,    0,    0,            // CDC control
    5,  0x24, 0,    0x20, 0x01, 5, 0x24, 1,    0,  2,    4, 0x24, 2, 2,  5,    0x24, 6,    1,
    2,  7,    5,    0x82, 3,    8, 0,    16,   9,  4,    2, 0,    2, 10, 0,    0,    0,  // CDC data
    7,  5,    0x03, 2,    64,   0, 0,    7,    5,  0x83, 2, 64,   0, 0,
};
static_assert(sizeof kConfiguration == 105);

constexpr u8 kMsOs20[] = {
    10, 0, 0, 0, 0,   0,   3,   6,   30,  0,                                  // set header, Windows 8.1
    20, 0, 3, 0, 'W', 'I', 'N', 'U', 'S', 'B', 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  // compatible id
};
static_assert(sizeof kMsOs20 == 30);

constexpr u8 kObjectStore[] = {
    5,    15,   33,   0,    1,    28,   16,   5,    0, 0xdf, 0x60, 0xdd, 0xd8, 0x89, 0x45, 0xc7, 0x4c,
    0x9c, 0xd2, 0x65, 0x9d, 0x9e, 0x64, 0x8a, 0x9f, 0, 0,    3,    6,    30,   0,    1,    0,
};
static_assert(sizeof kObjectStore == 33);

constexpr u8 kLanguage[] = {4, 3, 9, 4};
constexpr u8 kMaker[] = {14, 3, 's', 0, 'y', 0, 'm', 0, 'r', 0, 'i', 0, 'g', 0};
constexpr u8 kName[] = {20, 3, 't', 0, 'e', 0, 's', 0, 't', 0, ' ', 0, 'u', 0, 'n', 0, 'i', 0, 't', 0};
constexpr u8 kSerial[] = {10, 3, '0', 0, '0', 0, '4', 0, '2', 0};
constexpr const u8* kStrings[] = {kLanguage, kMaker, kName, kSerial};
constexpr u8 kStringCount = 4;

}  // namespace descriptors

RP_RESULTS;
using namespace rp;

namespace {

constexpr u32 kAvailable = 1U << 10, kStall = 1U << 11, kSelectReset = 1U << 12, kData1 = 1U << 13,
              kLast = 1U << 14, kFull = 1U << 15;
constexpr u32 kLength = 0x3ff;
constexpr u32 kPacket = 64;
constexpr u32 kSink = 4;

// Vendor requests.
constexpr u8 kWrongToggle = 2, kStallEcho = 3, kListen = 4, kReattach = 5, kSinkCount = 7, kMsOs = 1;

volatile u32& buffer_control(u32 endpoint, bool out) {
  return reg(kUsbRam + 0x80 + 8 * endpoint + (out ? 4 : 0));
}
volatile u32& endpoint_control(u32 endpoint, bool out) {
  return reg(kUsbRam + 8 * endpoint + (out ? 4 : 0));
}
constexpr u32 buffer(u32 endpoint, bool out) {
  return endpoint == 0 ? 0x100 : 0x180 + 0x100 * (endpoint - 1) + (out ? 0x80 : 0);
}
volatile u8* memory(u32 offset) {
  return reinterpret_cast<volatile u8*>(kUsbRam + offset);
}

bool toggle[5][2];
bool listening = true, owed_echo;
volatile u32 sunk;
u32 sink_half;

void pause() {
  asm volatile("nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop");
}

void arm(u32 endpoint, bool out, u32 size) {
  bool& next = toggle[endpoint][out];
  const u32 word = size | kLast | (next ? kData1 : 0) | (out ? 0 : kFull);
  next = !next;
  buffer_control(endpoint, out) = word;
  pause();
  buffer_control(endpoint, out) = word | kAvailable;
}

/// One half of the sink's two buffers.
void arm_sink(u32 half) {
  bool& next = toggle[kSink][1];
  const u32 shift = 16 * half;
  const u32 word = ((kPacket | kLast | (next ? kData1 : 0)) << shift);
  next = !next;
  const u32 others = buffer_control(kSink, true) & ~(0xffffU << shift);
  buffer_control(kSink, true) = others | word;
  pause();
  buffer_control(kSink, true) = others | word | (kAvailable << shift);
}

// ---- endpoint 0

struct Control {
  const u8* data;
  u32 left;
  bool in, zero_owed, receiving;
  u8 address;
  bool address_new;
} control;
u8 line_coding[7] = {0x00, 0xc2, 0x01, 0x00, 0, 0, 8};
u8 scratch[4];

void send_more() {
  const u32 size = control.left < kPacket ? control.left : kPacket;
  for (u32 i = 0; i < size; ++i) memory(0x100)[i] = control.data[i];
  control.data += size;
  control.left -= size;
  if (size < kPacket) control.zero_owed = false;
  arm(0, false, size);
}

void reply(const u8* data, u32 size, u32 wanted) {
  control.zero_owed = size < wanted && size % kPacket == 0;
  control.data = data;
  control.left = size < wanted ? size : wanted;
  control.in = true;
  send_more();
}

void acknowledge() {
  control.in = false;
  toggle[0][0] = true;
  arm(0, false, 0);
}

void refuse() {
  reg(kUsb + 0x68) = 3;
  buffer_control(0, false) = kStall;
  buffer_control(0, true) = kStall;
}

/// Takes the buffers of all endpoints but 0 from the controller.
void take_back() {
  constexpr u32 kAll = 0x3fc;
  reg(kUsb + 0x60) = kAll;  // EP_ABORT
  while ((reg(kUsb + 0x64) & kAll) != kAll) {
  }
  for (u32 endpoint = 1; endpoint < 5; ++endpoint)
    for (u32 out = 0; out < 2; ++out) buffer_control(endpoint, out != 0) = 0;
  reg(kUsb + 0x60) = 0;
  reg(kUsb + 0x64) = kAll;
}

void configure(bool on) {
  take_back();
  for (u32 endpoint = 1; endpoint < 5; ++endpoint) {
    for (u32 out = 0; out < 2; ++out) {
      toggle[endpoint][out] = false;
      const u32 type = endpoint == 2 ? 3 : 2;
      const u32 two = endpoint == kSink ? 1U << 30 : 0;
      const bool used = on && !(endpoint == 2 && out) && !(endpoint == kSink && !out);
      endpoint_control(endpoint, out != 0) =
          used ? (1U << 31) | (1U << 29) | two | (type << 26) | buffer(endpoint, out != 0) : 0;
    }
  }
  owed_echo = false;
  if (!on) return;
  arm(1, true, kPacket);
  arm(3, true, kPacket);
  sink_half = 0;
  buffer_control(kSink, true) = kSelectReset;
  arm_sink(0);
  arm_sink(1);
}

void descriptor(u8 type, u8 index, u32 wanted) {
  using namespace descriptors;
  if (type == 1) return reply(kDevice, sizeof kDevice, wanted);
  if (type == 2) return reply(kConfiguration, sizeof kConfiguration, wanted);
  if (type == 15) return reply(kObjectStore, sizeof kObjectStore, wanted);
  if (type == 3 && index < kStringCount) return reply(kStrings[index], kStrings[index][0], wanted);
  refuse();
}

void listen_again() {
  if (owed_echo && listening) {
    owed_echo = false;
    arm(1, true, kPacket);
  }
}

void vendor_request(u8 request, u32 value, u32 index, u32 wanted) {
  if (request == kMsOs && index == 7) return reply(descriptors::kMsOs20, sizeof descriptors::kMsOs20, wanted);
  if (request == kSinkCount) {
    for (u32 i = 0; i < 4; ++i) scratch[i] = static_cast<u8>(sunk >> (8 * i));
    return reply(scratch, 4, wanted);
  }
  if (request == kWrongToggle) toggle[1][value & 1] = !toggle[1][value & 1];
  if (request == kStallEcho) buffer_control(1, false) = kStall;
  if (request == kListen) {
    listening = value != 0;
    listen_again();
  }
  if (request < kWrongToggle || request > kReattach) return refuse();
  acknowledge();
  if (request != kReattach) return;
  for (volatile u32 i = 0; i < 2000;) i = i + 1;
  reg(kUsb + 0x4c + kClear) = 1U << 16;
  for (volatile u32 i = 0; i < 20000;) i = i + 1;
  reg(kUsb + 0x4c + kSet) = 1U << 16;
}

void setup() {
  const volatile u8* s = memory(0);
  const u8 kind = s[0], request = s[1];
  const u32 value = s[2] | (s[3] << 8), index = s[4] | (s[5] << 8), wanted = s[6] | (s[7] << 8);
  toggle[0][0] = toggle[0][1] = true;
  control = {nullptr, 0, false, false, false, control.address, false};
  if ((kind & 0x60) == 0x40) return vendor_request(request, value, index, wanted);
  if (kind == 0x80 && request == 6)
    return descriptor(static_cast<u8>(value >> 8), static_cast<u8>(value), wanted);
  if (kind == 0xa1 && request == 0x21) return reply(line_coding, 7, wanted);
  if (kind == 0x21 && request == 0x20) {
    control.receiving = true;
    return arm(0, true, kPacket);
  }
  if (kind == 0x21 && request == 0x22) return acknowledge();
  if (kind == 0x02 && request == 1 && value == 0) {
    toggle[index & 15][(index & 0x80) == 0] = false;
    if (index == 0x81) buffer_control(1, false) = 0;
    return acknowledge();
  }
  if (kind == 0 && request == 9) {
    configure(value != 0);
    return acknowledge();
  }
  if (kind != 0 || request != 5) return refuse();
  control.address = static_cast<u8>(value);
  control.address_new = true;
  acknowledge();
}

void control_in_done() {
  if (control.address_new) {
    reg(kUsb) = control.address;
    control.address_new = false;
  }
  if (!control.in) return;
  if (control.left > 0 || control.zero_owed) return send_more();
  toggle[0][1] = true;
  arm(0, true, 0);  // status stage
}

void control_out_done() {
  if (!control.receiving) return;
  control.receiving = false;
  for (u32 i = 0; i < 7; ++i) line_coding[i] = memory(0x100)[i];
  acknowledge();
}

// ---- the other endpoints

void echo(u32 endpoint, u8 capital) {
  const u32 size = buffer_control(endpoint, true) & kLength;
  for (u32 i = 0; i < size; ++i) {
    const u8 byte = memory(buffer(endpoint, true))[i];
    memory(buffer(endpoint, false))[i] = byte >= 'a' && byte <= 'z' ? byte & ~capital : byte;
  }
  arm(endpoint, false, size);
}

void sink() {
  sunk = sunk + ((buffer_control(kSink, true) >> (16 * sink_half)) & kLength);
  arm_sink(sink_half);
  sink_half ^= 1;
}

void buffers() {
  const u32 done = reg(kUsb + 0x58);
  reg(kUsb + 0x58) = done;
  if ((done & 1) != 0) control_in_done();
  if ((done & 2) != 0) control_out_done();
  if ((done & (2U << 2)) != 0) echo(1, 0);
  if ((done & (1U << 2)) != 0) {
    owed_echo = true;
    listen_again();
  }
  if ((done & (2U << 6)) != 0) echo(3, 0x20);
  if ((done & (1U << 6)) != 0) arm(3, true, kPacket);
  if ((done & (2U << 8)) != 0) sink();
}

}  // namespace

extern "C" void on_usb() {
  const u32 status = reg(kUsb + 0x98);
  if ((status & (1U << 12)) != 0) {
    reg(kUsb + 0x50) = 1U << 19;
    reg(kUsb) = 0;
    configure(false);
    tell('r');
  }
  if ((status & (1U << 14)) != 0) {
    reg(kUsb + 0x50) = 1U << 4;
    tell('u');
  }
  if ((status & (1U << 17)) != 0) {
    results.values[200] = reg(kUsb + 0x48);  // SOF_RD, which clears the interrupt
    results.values[201] = results.values[201] + 1;
  }
  if ((status & (1U << 16)) != 0) {
    reg(kUsb + 0x50) = 1U << 17;
    setup();
  }
  if ((status & (1U << 4)) != 0) buffers();
}

void program() {
  start_clocks();
  results.count = 0;
  results.values[201] = 0;
  reg(kResets + kSet) = 1U << 24;
  release(1U << 24);
  for (u32 at = 0; at < 0x1000; at += 4) reg(kUsbRam + at) = 0;
  reg(kUsb + 0x74) = 9;
  reg(kUsb + 0x78) = 0xc;
  reg(kUsb + 0x40) = 1;
  reg(kUsb + 0x4c) = 1U << 29;
  reg(kUsb + 0x90) = (1U << 4) | (1U << 12) | (1U << 14) | (1U << 16) | (1U << 17);
  enable_irq(kIrqUsb);
  reg(kUsb + 0x4c + kSet) = 1U << 16;
}
