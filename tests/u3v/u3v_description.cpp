// SPDX-License-Identifier: Apache-2.0
#include "u3v/u3v_camera.hpp"

#include <initializer_list>

namespace symrig::u3v {
namespace {

using Bytes = test::UsbDescription::Bytes;

void add(Bytes& to, std::initializer_list<std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) to.push_back(byte);
}

/// A bulk endpoint of SuperSpeed with its companion.
void add_endpoint(Bytes& to, std::uint8_t address) {
  add(to, {7, 5, address, 2, 0x00, 0x04, 0});
  add(to, {6, 0x30, 0, 0, 0, 0});
}

Bytes configuration() {
  constexpr std::uint8_t kMisc = 0xEF, kVision = 5, kControl = 0, kStream = 2;
  Bytes all{9, 2, 0, 0, 2, 1, 0, 0x80, 62};
  add(all, {8, 0x0B, 0, 2, kMisc, kVision, kControl, 0});  // both interfaces are one function
  add(all, {9, 4, 0, 0, 2, kMisc, kVision, kControl, 0});
  // Versions of GenCP and of USB3 Vision, strings (GUID, maker, model, -, -, -, serial, -), speeds:
  // SuperSpeed.
  add(all, {20, 0x24, 1, 0, 0, 1, 0, 0, 0, 1, 0, 4, 1, 2, 0, 0, 0, 3, 0, 8});
  add_endpoint(all, 0x81);
  add_endpoint(all, 0x01);
  add(all, {9, 4, 1, 0, 1, kMisc, kVision, kStream, 0});
  add_endpoint(all, 0x82);
  all[2] = static_cast<std::uint8_t>(all.size());
  all[3] = static_cast<std::uint8_t>(all.size() >> 8U);
  return all;
}

}  // namespace

test::UsbDescription u3v_description(const std::string& serial) {
  test::UsbDescription described;
  described.name = "u3v";
  described.speed = test::UsbSpeed::super;
  // 1209:0002 is for tests (pid.codes). Class, subclass and protocol: interfaces are grouped.
  described.device = {18, 1, 0x00, 0x03, 0xEF, 2, 1, 9, 0x09, 0x12, 0x02, 0x00, 0, 1, 1, 2, 3, 1};
  described.configuration = configuration();
  described.strings = {"Symrig", "Loopback", serial, "1209" + serial};
  // The capabilities of USB 3.0, without link power states.
  described.others[0x0F] = {5, 0x0F, 22, 0, 2, 7, 0x10, 2, 0, 0, 0, 0, 10, 0x10, 3, 0, 8, 0, 3, 0, 0, 0};
  described.interface_classes = {0xEF, 5, 0, 0xEF, 5, 2};
  return described;
}

}  // namespace symrig::u3v
