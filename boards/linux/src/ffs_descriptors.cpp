// SPDX-License-Identifier: Apache-2.0
#include "ffs_descriptors.hpp"

#include <string_view>

#include <linux/usb/functionfs.h>

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

}  // namespace

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

std::vector<std::uint8_t> ffs_strings() {
  Bytes out;
  constexpr std::uint32_t kTextSize = kInterface.size() + 1;
  out.u32(FUNCTIONFS_STRINGS_MAGIC), out.u32(16 + 2 + kTextSize), out.u32(1), out.u32(1);
  out.u16(kEnglish), out.text(kInterface, kTextSize);
  return out.take();
}

}  // namespace symrig::board_linux
