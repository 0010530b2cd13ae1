// SPDX-License-Identifier: Apache-2.0
#include "device_option.hpp"

#include "symrig/device/link.hpp"

#include <utility>

namespace symrig::apps {

void add_device(CLI::App& command, std::string& device) {
  command.add_option("--device", device, "The board: a serial number or how it begins, or a URI (see below)")
      ->type_name("URI|SERIAL");
}

Result<device::DeviceUri> choose_board(const std::string& device) {
  auto uri = device::choose_board(device);
  if (uri || uri.error().code != ErrorCode::device_lost) return uri;
  Error error = uri.error();
  error.hint += "; sim: is a simulated board";
  return error;
}

Result<device::Board> open_board(const device::DeviceUri& uri, const device::BoardOptions& options) {
  SYMRIG_TRY(auto link, device::open_link(uri));
  return device::Board::connect(std::move(link), options);
}

Result<device::Board> open_board(const std::string& device, const device::BoardOptions& options) {
  SYMRIG_TRY(const auto uri, choose_board(device));
  return open_board(uri, options);
}

}  // namespace symrig::apps
