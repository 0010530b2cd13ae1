// SPDX-License-Identifier: Apache-2.0
#include "board_pins.hpp"
#include "usb_device.hpp"

namespace symrig::pico::usb_descriptors {
namespace {

constexpr uint8_t low(uint32_t value) {
  return static_cast<uint8_t>(value);
}
constexpr uint8_t high(uint32_t value) {
  return static_cast<uint8_t>(value >> 8U);
}

enum : uint8_t {
  kNoString,
  kMakerString,
  kProductString,
  kSerialString,
  kWireString,
  kConsoleString,
  kResetString
};

constexpr uint8_t kDevice[] = {18,
                               1,
                               0x10,
                               0x02,  // USB 2.1: has a BOS
                               0xef,
                               2,
                               1,   // interfaces are grouped
                               64,  // endpoint 0
                               low(kUsbVendor),
                               high(kUsbVendor),
                               low(kUsbProduct),
                               high(kUsbProduct),
                               0x00,
                               0x01,  // release 1.0
                               kMakerString,
                               kProductString,
                               kSerialString,
                               1};

constexpr uint8_t kBulk = 2;
constexpr uint8_t kInterrupt = 3;
constexpr uint8_t kIn = 0x80;

constexpr uint16_t kConfigurationSize = 107;
constexpr uint8_t kConfiguration[kConfigurationSize] = {
    9, 2, low(kConfigurationSize), high(kConfigurationSize), 4, 1, 0, 0x80, 50,  // bus powered, 100 mA
    // 0: the wire
    9, 4, 0, 0, 2, 0xff, 0, 0, kWireString, 7, 5, kWire, kBulk, 64, 0, 0, 7, 5, kIn | kWire, kBulk, 64, 0, 0,
    // 1 and 2: the console
    8, 11, 1, 2, 2, 2, 0, kConsoleString, 9, 4, 1, 0, 1, 2, 2, 0, kConsoleString, 5, 0x24, 0, 0x10,
    0x01,              // CDC 1.1
    5, 0x24, 1, 0, 2,  // calls are not handled; data are on interface 2
    4, 0x24, 2, 2,     // line coding
    5, 0x24, 6, 1, 2,  // union
    7, 5, kIn | kNotice, kInterrupt, 8, 0, 255, 9, 4, 2, 0, 2, 10, 0, 0, kConsoleString, 7, 5, kConsole,
    kBulk, 64, 0, 0, 7, 5, kIn | kConsole, kBulk, 64, 0, 0,
    // 3: picotool's way into the boot loader; control requests only
    9, 4, kResetInterface, 0, 0, 0xff, 0, 1, kResetString};

// Microsoft OS 2.0 descriptors: header, configuration subset, and for interfaces 0 and 3 a function subset
// with WinUSB and an interface GUID.
constexpr char kGuidName[] = "DeviceInterfaceGUIDs";
constexpr char kGuid[] = "{6B8A3D5C-9E0F-4C1B-8A57-2D4F1E7C9B30}";
constexpr char kResetGuid[] = "{6B8A3D5C-9E0F-4C1B-8A57-2D4F1E7C9B33}";
static_assert(sizeof kGuid == sizeof kResetGuid);
constexpr uint16_t kGuidNameSize = 2 * sizeof kGuidName;
constexpr uint16_t kGuidSize = 2 * sizeof kGuid + 2;  // a list of strings ends with an empty one
constexpr uint16_t kPropertySize = 8 + kGuidNameSize + 2 + kGuidSize;
constexpr uint16_t kFunctionSize = 8 + 20 + kPropertySize;
constexpr uint16_t kSubsetSize = 8 + 2 * kFunctionSize;
constexpr uint16_t kMicrosoftSize = 10 + kSubsetSize;

struct Microsoft {
  uint8_t bytes[kMicrosoftSize];
};

struct Writer {
  Microsoft out{};
  uint32_t at = 0;
  constexpr void u8(uint32_t value) { out.bytes[at++] = low(value); }
  constexpr void u16(uint32_t value) {
    u8(value);
    u8(value >> 8U);
  }
  constexpr void utf16(const char* text, uint32_t size) {
    for (uint32_t i = 0; i < size; ++i) u16(static_cast<uint8_t>(text[i]));
  }
};

constexpr void add_function(Writer& w, uint32_t interface, const char* guid) {
  w.u16(8), w.u16(2), w.u8(interface), w.u8(0), w.u16(kFunctionSize);
  w.u16(20), w.u16(3);
  constexpr char kDriver[16] = "WINUSB";  // 8 bytes of compatible id, 8 of sub-compatible id
  for (const char c : kDriver) w.u8(static_cast<uint8_t>(c));
  w.u16(kPropertySize), w.u16(4), w.u16(7);  // a list of strings
  w.u16(kGuidNameSize);
  w.utf16(kGuidName, sizeof kGuidName);
  w.u16(kGuidSize);
  w.utf16(guid, sizeof kGuid);
  w.u16(0);
}

constexpr Microsoft make_microsoft() {
  Writer w;
  w.u16(10), w.u16(0), w.u16(0), w.u16(0x0603), w.u16(kMicrosoftSize);  // for Windows 8.1 and later
  w.u16(8), w.u16(1), w.u8(0), w.u8(0), w.u16(kSubsetSize);
  add_function(w, 0, kGuid);
  add_function(w, kResetInterface, kResetGuid);
  return w.out;
}

constexpr uint16_t kBosSize = 5 + 28;
constexpr uint8_t kBos[kBosSize] = {5,
                                    15,
                                    low(kBosSize),
                                    high(kBosSize),
                                    1,
                                    28,
                                    16,
                                    5,
                                    0,  // platform capability: Microsoft OS 2.0
                                    0xdf,
                                    0x60,
                                    0xdd,
                                    0xd8,
                                    0x89,
                                    0x45,
                                    0xc7,
                                    0x4c,
                                    0x9c,
                                    0xd2,
                                    0x65,
                                    0x9d,
                                    0x9e,
                                    0x64,
                                    0x8a,
                                    0x9f,
                                    0x00,
                                    0x00,
                                    0x03,
                                    0x06,  // Windows 8.1
                                    low(kMicrosoftSize),
                                    high(kMicrosoftSize),
                                    kMsVendorCode,
                                    0};

}  // namespace

Bytes device() {
  return {kDevice, sizeof kDevice};
}
Bytes configuration() {
  return {kConfiguration, sizeof kConfiguration};
}
Bytes bos() {
  return {kBos, sizeof kBos};
}
Bytes microsoft() {
  static constexpr Microsoft made = make_microsoft();
  return {made.bytes, sizeof made.bytes};
}

const char* string(uint8_t number, const char* serial) {
  switch (number) {
    case kMakerString:
      return kUsbManufacturer;
    case kProductString:
      return kUsbProductName;
    case kSerialString:
      return serial;
    case kWireString:
      return kUsbInterface;
    case kConsoleString:
      return "symrig log";
    case kResetString:
      return "Reset";
    default:
      return nullptr;
  }
}

}  // namespace symrig::pico::usb_descriptors
