// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/link.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <iterator>
#include <system_error>

#include <fmt/format.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;

constexpr std::uint16_t kVendor = 0x1209;
constexpr std::string_view kName = "symrig";

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

bool begins_with(std::string_view text, std::string_view start) {
  return lower(text.substr(0, start.size())) == lower(start);
}

bool is_ours(const fs::path& port) {
  return begins_with(port.filename().string(), "usb-symrig");
}

/// udev's names are usb-MAKER_PRODUCT_SERIAL-ifNN (blanks are underscores) and link to the port.
std::optional<FoundBoard> found_on_serial(const fs::directory_entry& entry) {
  if (!is_ours(entry.path())) return std::nullopt;
  std::string name = entry.path().filename().string();
  name = name.substr(0, name.rfind("-if")).substr(4);
  const std::size_t cut = name.rfind('_');
  FoundBoard board{.uri = {.transport = Transport::serial, .place = entry.path().string()},
                   .serial = cut == std::string::npos ? "" : name.substr(cut + 1),
                   .product = name.substr(0, cut)};
  std::replace(board.product.begin(), board.product.end(), '_', ' ');
  std::error_code error;
  const fs::path port = fs::canonical(entry.path(), error);
  board.port = error ? entry.path().string() : port.string();
  return board;
}

bool holds_serial(std::span<const FoundBoard> boards, const std::string& serial) {
  return std::any_of(boards.begin(), boards.end(),
                     [&](const FoundBoard& board) { return board.serial == serial; });
}

std::vector<FoundBoard> found_on_serial(const fs::path& folder) {
  std::vector<FoundBoard> boards;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (auto board = found_on_serial(*entry)) boards.push_back(*std::move(board));
  return boards;
}

void sort_by_serial(std::vector<FoundBoard>& boards) {
  std::sort(boards.begin(), boards.end(), [](const FoundBoard& a, const FoundBoard& b) {
    return std::pair(a.serial, a.port) < std::pair(b.serial, b.port);
  });
}

std::string list_of(std::span<const FoundBoard> boards) {
  std::string text;
  for (const FoundBoard& board : boards)
    text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", board.uri.text(), board.port);
  return text;
}

Error none_there() {
  return {ErrorCode::device_lost, "no board is connected",
          "check its cable; symrig list shows the connected boards, and serial ports that may have one"};
}

}  // namespace

bool is_symrig(const UsbDevice& device) {
  return device.vendor == kVendor && (begins_with(device.maker, kName) || begins_with(device.product, kName));
}

FoundBoard as_board(const UsbDevice& device) {
  FoundBoard board;
  board.uri.transport = Transport::usb;
  board.uri.place = device.serial;
  board.serial = device.serial;
  board.product = device.product;
  board.port = device.port;
  board.accessible = device.accessible;
  return board;
}

Result<std::vector<FoundBoard>> find_boards(UsbBus& bus, const fs::path& serial_ports) {
  SYMRIG_TRY(const auto devices, bus.devices());
  std::vector<FoundBoard> boards;
  for (const UsbDevice& device : devices)
    if (is_symrig(device)) boards.push_back(as_board(device));
  sort_by_serial(boards);
  std::vector<FoundBoard> ports = found_on_serial(serial_ports);
  sort_by_serial(ports);
  // A board with a vendor interface uses it for the protocol. Its serial port is for its log.
  const std::vector<FoundBoard> on_usb = boards;
  std::copy_if(ports.begin(), ports.end(), std::back_inserter(boards),
               [&](const FoundBoard& port) { return !holds_serial(on_usb, port.serial); });
  return boards;
}

Result<std::vector<FoundBoard>> find_boards() {
  return find_boards(*system_usb_bus());
}

std::vector<DeviceUri> other_serial_ports(const fs::path& serial_ports) {
  std::vector<DeviceUri> ports;
  std::error_code error;
  for (fs::directory_iterator entry(serial_ports, error), end; !error && entry != end; entry.increment(error))
    if (!is_ours(entry->path()))
      ports.push_back({.transport = Transport::serial, .place = entry->path().string()});
  std::sort(ports.begin(), ports.end(),
            [](const DeviceUri& a, const DeviceUri& b) { return a.place < b.place; });
  return ports;
}

Result<DeviceUri> choose_board(std::span<const FoundBoard> found, std::string_view wanted) {
  if (looks_like_uri(wanted)) return DeviceUri::parse(wanted);
  std::vector<FoundBoard> fits;
  std::copy_if(found.begin(), found.end(), std::back_inserter(fits),
               [wanted](const FoundBoard& board) { return begins_with(board.serial, wanted); });
  if (fits.size() == 1) return fits.front().uri;
  if (found.empty()) return none_there();
  if (fits.empty())
    return Error{ErrorCode::unknown_name,
                 fmt::format("no board has a serial number that begins with '{}'", wanted),
                 fmt::format("connected: {}", list_of(found))};
  return Error{ErrorCode::bad_argument,
               wanted.empty() ? fmt::format("{} boards are connected", fits.size())
                              : fmt::format("'{}' matches {} boards", wanted, fits.size()),
               fmt::format("name one of them: {}", list_of(fits))};
}

Result<DeviceUri> choose_board(std::string_view wanted) {
  std::string name(wanted);
  if (const char* variable = std::getenv("SYMRIG_DEVICE"); name.empty() && variable != nullptr)
    name = variable;
  if (looks_like_uri(name)) return DeviceUri::parse(name);
  SYMRIG_TRY(const auto found, find_boards());
  return choose_board(found, name);
}

}  // namespace symrig
