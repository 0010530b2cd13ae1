// SPDX-License-Identifier: Apache-2.0
#include "dlpc/controller_on_usb.hpp"

#include <algorithm>
#include <utility>

namespace symrig::test {
namespace {

using Bytes = UsbDevice::Bytes;

/// One interface with an endpoint in each direction (USB 2.0 chapter 9, HID 1.11).
UsbDescription hid_description(const EmulatedController& device) {
  const auto low = static_cast<std::uint8_t>(device.product_id()),
             high = static_cast<std::uint8_t>(device.product_id() >> 8U);
  const Bytes hid{9, 0x21, 0x11, 0x01, 0, 1, 0x22, 27, 0};
  const Bytes report{0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01, 0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08,
                     0x95, 0x40, 0x09, 0x01, 0x81, 0x02, 0x95, 0x40, 0x09, 0x01, 0x91, 0x02, 0xC0};
  UsbDescription described;
  described.name = device.product();
  described.device = {18, 1, 0, 2, 0, 0, 0, 64, 0x51, 0x04, low, high, 0, 1, 1, 2, 0, 1};
  described.configuration = {9, 2, 41, 0, 1, 1, 0, 0xC0, 50, 9, 4, 0, 0, 2, 3, 0, 0, 0};
  described.configuration.insert(described.configuration.end(), hid.begin(), hid.end());
  for (const std::uint8_t endpoint : {std::uint8_t{0x81}, std::uint8_t{0x01}})
    described.configuration.insert(described.configuration.end(), {7, 5, endpoint, 3, 64, 0, 1});
  described.strings = {"Texas Instruments", device.product()};
  described.others = {{0x21, hid}, {0x22, report}};
  described.interface_classes = {3, 0, 0};
  return described;
}

class ControllerOnUsb final : public UsbDevice {
 public:
  explicit ControllerOnUsb(std::shared_ptr<EmulatedController> device) : device_(std::move(device)) {}

  const UsbDescription& description() const override { return description_; }
  bool out(unsigned /*endpoint*/, std::span<const std::uint8_t> bytes) override {
    EmulatedController::Report report{};
    std::copy_n(bytes.begin(), std::min(bytes.size(), report.size()), report.begin());
    return device_->report(report);
  }
  std::optional<Bytes> in(unsigned /*endpoint*/, std::size_t most) override {
    const auto report = device_->next();
    if (!report) return std::nullopt;
    const std::size_t length = std::min(most, report->size());
    return Bytes(report->begin(), report->begin() + static_cast<std::ptrdiff_t>(length));
  }

 private:
  std::shared_ptr<EmulatedController> device_;
  UsbDescription description_ = hid_description(*device_);
};

}  // namespace

std::shared_ptr<UsbDevice> on_usb(std::shared_ptr<EmulatedController> device) {
  return std::make_shared<ControllerOnUsb>(std::move(device));
}

}  // namespace symrig::test
