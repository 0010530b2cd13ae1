// SPDX-License-Identifier: Apache-2.0
#include "board/links/usb.hpp"

#include <array>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

namespace symrig::board::usb {
namespace {

Error no_usb(int code) {
  return {ErrorCode::io, fmt::format("the USB devices cannot be listed ({})", libusb_strerror(code)),
          "name the board by its URI instead"};
}

struct FreeConfig {
  void operator()(libusb_config_descriptor* config) const { libusb_free_config_descriptor(config); }
};

std::optional<Pipes> pipes_of(const libusb_interface_descriptor& interface) {
  if (interface.bInterfaceClass != LIBUSB_CLASS_VENDOR_SPEC) return std::nullopt;
  Pipes pipes{.interface = interface.bInterfaceNumber};
  for (const auto& endpoint : std::span(interface.endpoint, interface.bNumEndpoints)) {
    if ((endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK) continue;
    if ((endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN) == 0) {
      pipes.out = endpoint.bEndpointAddress;
    } else {
      pipes.in = endpoint.bEndpointAddress;
      pipes.in_packet = endpoint.wMaxPacketSize;
    }
  }
  if (pipes.in == 0 || pipes.out == 0 || pipes.in_packet == 0) return std::nullopt;
  return pipes;
}

std::optional<Pipes> pipes_of(libusb_device* device) {
  libusb_config_descriptor* raw = nullptr;
  if (libusb_get_active_config_descriptor(device, &raw) != 0) return std::nullopt;
  const std::unique_ptr<libusb_config_descriptor, FreeConfig> config(raw);
  for (const auto& interface : std::span(config->interface, config->bNumInterfaces))
    if (interface.num_altsetting > 0)
      if (auto pipes = pipes_of(interface.altsetting[0])) return pipes;
  return std::nullopt;
}

/// "1-4.2", the name of the device in sysfs; "" for a root hub.
std::string port_of(libusb_device* device) {
  std::array<std::uint8_t, 8> ports{};
  const int count = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string text;
  for (int k = 0; k < count; ++k) text += fmt::format("{}{}", k == 0 ? "" : ".", ports[k]);
  return text.empty() ? text : fmt::format("{}-{}", libusb_get_bus_number(device), text);
}

/// A string that the kernel read when the device was connected. Needs no permission and does not disturb
/// other users of the device.
std::string kernel_text(const std::string& port, const char* what) {
  std::ifstream file(fmt::format("/sys/bus/usb/devices/{}/{}", port, what));
  std::string line;
  std::getline(file, line);
  return line;
}

UsbDevice about(libusb_device* device, const libusb_device_descriptor& descriptor) {
  const std::string port = port_of(device);
  const std::string node = fmt::format("/dev/bus/usb/{:03}/{:03}", libusb_get_bus_number(device),
                                       libusb_get_device_address(device));
  return {.vendor = descriptor.idVendor,
          .product_id = descriptor.idProduct,
          .maker = kernel_text(port, "manufacturer"),
          .product = kernel_text(port, "product"),
          .serial = kernel_text(port, "serial"),
          .port = port,
          .accessible = ::access(node.c_str(), R_OK | W_OK) == 0};
}

}  // namespace

Result<Context> make_context() {
  libusb_context* context = nullptr;
  if (const int code = libusb_init(&context); code != 0) return no_usb(code);
  return Context(context);
}

Result<std::vector<Candidate>> candidates(libusb_context& context) {
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(&context, &list);
  if (count < 0) return no_usb(static_cast<int>(count));
  std::vector<Candidate> found;
  for (libusb_device* one : std::span(list, static_cast<std::size_t>(count))) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(one, &descriptor) != 0) continue;
    if (const auto pipes = pipes_of(one))
      found.push_back({Device(libusb_ref_device(one)), *pipes, about(one, descriptor)});
  }
  libusb_free_device_list(list, 1);
  return found;
}

}  // namespace symrig::board::usb

namespace symrig {
namespace {

class SystemUsbBus final : public UsbBus {
 public:
  Result<std::vector<UsbDevice>> devices() override {
    SYMRIG_TRY(const auto context, board::usb::make_context());
    SYMRIG_TRY(const auto candidates, board::usb::candidates(*context));
    std::vector<UsbDevice> devices;
    devices.reserve(candidates.size());
    for (const board::usb::Candidate& one : candidates) devices.push_back(one.about);
    return devices;
  }
};

}  // namespace

std::unique_ptr<UsbBus> system_usb_bus() {
  return std::make_unique<SystemUsbBus>();
}

}  // namespace symrig
