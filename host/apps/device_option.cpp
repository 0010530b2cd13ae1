// SPDX-License-Identifier: Apache-2.0
#include "device_option.hpp"

#include "symrig/board/link.hpp"

#include <utility>

namespace symrig::apps {

void add_device(CLI::App& command, std::string& device) {
  command.add_option("--device", device, "The board: a serial number or its beginning, or a URI (see below)")
      ->type_name("URI|SERIAL");
}

Result<DeviceUri> choose_board(const std::string& device) {
  auto uri = symrig::choose_board(device);
  if (uri || uri.error().code != ErrorCode::device_lost) return uri;
  Error error = uri.error();
  error.hint += "; sim: is the simulated board";
  return error;
}

Result<Board> open_board(const DeviceUri& uri, const BoardOptions& options) {
  SYMRIG_TRY(auto link, open_link(uri));
  return Board::connect(std::move(link), options);
}

Result<Board> open_board(const std::string& device, const BoardOptions& options) {
  SYMRIG_TRY(const auto uri, choose_board(device));
  return open_board(uri, options);
}

}  // namespace symrig::apps
