// SPDX-License-Identifier: Apache-2.0
#include "dlpc/usbip_server.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

namespace symrig::test {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::uint16_t kPort = 3240;
constexpr std::uint16_t kListDevices = 0x8005, kImportDevice = 0x8003;
constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kStall = static_cast<std::uint32_t>(-32);

// A HID device with one interface and a 64-byte endpoint in each direction (USB 2.0 chapter 9, HID 1.11).
const Bytes kReportDescriptor{0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01, 0x15, 0x00,
                              0x26, 0xFF, 0x00, 0x75, 0x08, 0x95, 0x40, 0x09, 0x01,
                              0x81, 0x02, 0x95, 0x40, 0x09, 0x01, 0x91, 0x02, 0xC0};
const Bytes kDeviceDescriptor{18, 1, 0, 2, 0, 0, 0, 64, 0x51, 0x04, 0x01, 0x64, 0, 1, 1, 2, 0, 1};
const Bytes kHidDescriptor{9, 0x21, 0x11, 0x01, 0, 1, 0x22, 27, 0};

Bytes configuration() {
  Bytes all{9, 2, 41, 0, 1, 1, 0, 0xC0, 50, 9, 4, 0, 0, 2, 3, 0, 0, 0};
  all.insert(all.end(), kHidDescriptor.begin(), kHidDescriptor.end());
  for (const std::uint8_t endpoint : {std::uint8_t{0x81}, std::uint8_t{0x01}})
    all.insert(all.end(), {7, 5, endpoint, 3, 64, 0, 1});
  return all;
}

Bytes string_descriptor(int index) {
  if (index == 0) return {4, 3, 9, 4};
  const std::string_view text = index == 1 ? "Texas Instruments" : "DLPC350";
  Bytes bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char c : text) bytes.insert(bytes.end(), {static_cast<std::uint8_t>(c), 0});
  return bytes;
}

/// What a control request reads; none: it stalls.
std::optional<Bytes> control(std::span<const std::uint8_t> setup) {
  constexpr std::uint8_t kGetStatus = 0, kGetDescriptor = 6;
  if (setup[1] == kGetStatus) return Bytes{0, 0};
  if (setup[1] != kGetDescriptor) return Bytes{};
  switch (setup[3]) {
    case 1:
      return kDeviceDescriptor;
    case 2:
      return configuration();
    case 3:
      return string_descriptor(setup[2]);
    case 0x21:
      return kHidDescriptor;
    case 0x22:
      return kReportDescriptor;
    default:
      return std::nullopt;
  }
}

void put_word(Bytes& bytes, std::uint32_t value) {
  for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

std::uint32_t word_of(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) value = value << 8U | bytes[at + k];
  return value;
}

bool receive(int socket, std::span<std::uint8_t> into) {
  while (!into.empty()) {
    const ssize_t got = ::recv(socket, into.data(), into.size(), 0);
    if (got <= 0) return false;
    into = into.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

bool send_all(int socket, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

/// The device as USB/IP describes it: path, bus, numbers.
Bytes exported() {
  Bytes bytes(256 + 32);
  constexpr std::string_view kPath = "/sys/devices/symrig/dlpc350", kBus = "1-1";
  std::copy(kPath.begin(), kPath.end(), bytes.begin());
  std::copy(kBus.begin(), kBus.end(), bytes.begin() + 256);
  for (const std::uint32_t word : {1U, 1U, 2U}) put_word(bytes, word);  // bus, device, full speed
  bytes.insert(bytes.end(), {0x04, 0x51, 0x64, 0x01, 0x01, 0x00, 0, 0, 0, 1, 1, 1});
  return bytes;
}

bool send_return(int socket, std::uint32_t number, std::uint32_t status, std::span<const std::uint8_t> data,
                 std::size_t length) {
  Bytes bytes;
  for (const std::uint32_t word :
       {3U, number, 0U, 0U, 0U, status, static_cast<std::uint32_t>(length), 0U, 0U, 0U})
    put_word(bytes, word);
  bytes.resize(48);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return send_all(socket, bytes);
}

}  // namespace

UsbIpServer::UsbIpServer(std::shared_ptr<EmulatedDlpc350> device)
    : device_(std::move(device)), listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const int on = 1;
  ::setsockopt(listener_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kPort);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener_.get(), 2) != 0)
    return;
  thread_ = std::thread([this] { serve(); });
}

UsbIpServer::~UsbIpServer() {
  stop_ = true;
  ::shutdown(listener_.get(), SHUT_RDWR);
  if (connection_ >= 0) ::shutdown(connection_, SHUT_RDWR);
  if (thread_.joinable()) thread_.join();
}

void UsbIpServer::serve() {
  while (!stop_) {
    const Fd connection(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (!connection) return;
    const int on = 1;
    ::setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    connection_ = connection.get();
    talk(connection.get());
    connection_ = -1;
  }
}

void UsbIpServer::talk(int connection) {
  std::array<std::uint8_t, 8> head{};
  if (!receive(connection, head)) return;
  const auto code = static_cast<std::uint16_t>(head[2] << 8 | head[3]);
  Bytes reply{0x01, 0x11, 0x00, static_cast<std::uint8_t>(code & 0xFF), 0, 0, 0, 0};
  if (code == kListDevices) put_word(reply, 1);
  const Bytes device = exported();
  reply.insert(reply.end(), device.begin(), device.end());
  if (code == kListDevices) {
    reply.insert(reply.end(), {3, 0, 0, 0});
    send_all(connection, reply);
    return;
  }
  std::array<std::uint8_t, 32> bus{};
  if (code != kImportDevice || !receive(connection, bus) || !send_all(connection, reply)) return;
  waiting_.clear();
  while (handle_request(connection)) {
  }
}

bool UsbIpServer::handle_request(int connection) {
  std::array<std::uint8_t, 48> head{};
  if (!receive(connection, head)) return false;
  const std::uint32_t command = word_of(head, 0), number = word_of(head, 4);
  if (command == kUnlink) return unlink(connection, number, word_of(head, 20));
  if (command != kSubmit) return false;
  return submit(connection, number, word_of(head, 12) != 0, word_of(head, 16), word_of(head, 24),
                std::span(head).subspan(40, 8));
}

bool UsbIpServer::unlink(int connection, std::uint32_t number, std::uint32_t victim) {
  constexpr auto kWasReset = static_cast<std::uint32_t>(-104);
  const auto removed = std::erase_if(waiting_, [victim](const Waiting& one) { return one.number == victim; });
  Bytes bytes;
  for (const std::uint32_t word : {4U, number, 0U, 0U, 0U, removed > 0 ? kWasReset : 0U})
    put_word(bytes, word);
  bytes.resize(48);
  return send_all(connection, bytes);
}

bool UsbIpServer::submit(int connection, std::uint32_t number, bool in, std::uint32_t endpoint,
                         std::size_t length, std::span<const std::uint8_t> setup) {
  Bytes data(in ? 0 : length);
  if (!receive(connection, data)) return false;
  if (endpoint == 0) {
    auto read = control(setup);
    if (!read) return send_return(connection, number, kStall, {}, 0);
    read->resize(std::min(read->size(), length));
    return in ? send_return(connection, number, 0, *read, read->size())
              : send_return(connection, number, 0, {}, length);
  }
  if (in) {
    waiting_.push_back({number, length});
    return answer_waiting(connection);
  }
  EmulatedDlpc350::Report report{};
  std::copy_n(data.begin(), std::min(data.size(), report.size()), report.begin());
  {
    const std::scoped_lock lock(mutex_);
    if (!device_->report(report)) return false;
  }
  return send_return(connection, number, 0, {}, length) && answer_waiting(connection);
}

bool UsbIpServer::answer_waiting(int connection) {
  const std::scoped_lock lock(mutex_);
  while (!waiting_.empty()) {
    const auto report = device_->next();
    if (!report) return true;
    const Waiting first = waiting_.front();
    waiting_.pop_front();
    const std::size_t length = std::min(first.length, report->size());
    if (!send_return(connection, first.number, 0, std::span(*report).first(length), length)) return false;
  }
  return true;
}

}  // namespace symrig::test
