// SPDX-License-Identifier: Apache-2.0
#include "usbip/usbip_server.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

namespace symrig::test {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::uint16_t kListDevices = 0x8005, kImportDevice = 0x8003;
constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kStall = static_cast<std::uint32_t>(-32);

Bytes string_descriptor(const std::vector<std::string>& strings, std::size_t index) {
  if (index == 0) return {4, 3, 9, 4};  // they are in American English
  if (index > strings.size()) return {2, 3};
  const std::string& text = strings[index - 1];
  Bytes bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char c : text) bytes.insert(bytes.end(), {static_cast<std::uint8_t>(c), 0});
  return bytes;
}

/// What a standard request reads; none: it stalls. Requests that set something succeed.
std::optional<Bytes> control_answer(const UsbDescription& described, std::span<const std::uint8_t> setup) {
  constexpr std::uint8_t kGetStatus = 0, kGetDescriptor = 6;
  if (setup[1] == kGetStatus) return Bytes{0, 0};
  if (setup[1] != kGetDescriptor) return Bytes{};
  if (setup[3] == 1) return described.device;
  if (setup[3] == 2) return described.configuration;
  if (setup[3] == 3) return string_descriptor(described.strings, setup[2]);
  const auto found = described.others.find(setup[3]);
  return found == described.others.end() ? std::nullopt : std::optional(found->second);
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
Bytes exported(const UsbDescription& described) {
  const std::string path = "/sys/devices/symrig/" + described.name, bus = "1-1";
  Bytes bytes(256 + 32);
  std::copy(path.begin(), path.end(), bytes.begin());
  std::copy(bus.begin(), bus.end(), bytes.begin() + 256);
  for (const std::uint32_t word : {1U, 1U, std::uint32_t{static_cast<std::uint8_t>(described.speed)}})
    put_word(bytes, word);  // bus, device, speed
  // Numbers of two bytes are little-endian in descriptors and big-endian here: vendor, product, release.
  for (const std::size_t at : {8U, 10U, 12U})
    bytes.insert(bytes.end(), {described.device[at + 1], described.device[at]});
  bytes.insert(bytes.end(), {described.device[4], described.device[5], described.device[6], 1, 1,
                             static_cast<std::uint8_t>(described.interface_classes.size() / 3)});
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

UsbIpServer::UsbIpServer(std::shared_ptr<UsbDevice> device, std::uint16_t port)
    : device_(std::move(device)), listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const int on = 1;
  ::setsockopt(listener_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener_.get(), 2) != 0)
    return;
  socklen_t length = sizeof address;
  ::getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &length);
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { serve(); });
}

UsbIpServer::~UsbIpServer() {
  stop_ = true;
  ::shutdown(listener_.get(), SHUT_RDWR);
  unplug();
  if (thread_.joinable()) thread_.join();
}

void UsbIpServer::serve() {
  while (!stop_) {
    const Fd connection(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (!connection) return;
    const int on = 1;
    ::setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    {
      const std::scoped_lock lock(mutex_);
      if (stop_) return;
      waiting_.clear();
      connection_ = connection.get();
    }
    talk(connection.get());
    const std::scoped_lock lock(mutex_);  // nobody sends to a socket that is closed
    connection_ = -1;
  }
}

void UsbIpServer::talk(int connection) {
  std::array<std::uint8_t, 8> head{};
  if (!receive(connection, head)) return;
  const auto code = static_cast<std::uint16_t>(head[2] << 8 | head[3]);
  Bytes reply{0x01, 0x11, 0x00, static_cast<std::uint8_t>(code & 0xFF), 0, 0, 0, 0};
  if (code == kListDevices) put_word(reply, 1);
  const UsbDescription& described = device_->description();
  const Bytes device = exported(described);
  reply.insert(reply.end(), device.begin(), device.end());
  if (code == kListDevices) {
    for (std::size_t k = 0; k < described.interface_classes.size(); k += 3) {
      const auto one = described.interface_classes.begin() + static_cast<std::ptrdiff_t>(k);
      reply.insert(reply.end(), one, one + 3);
      reply.push_back(0);
    }
    send_all(connection, reply);
    return;
  }
  std::array<std::uint8_t, 32> bus{};
  if (code != kImportDevice || !receive(connection, bus) || !send_all(connection, reply)) return;
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

void UsbIpServer::answer() {
  const std::scoped_lock lock(mutex_);
  if (connection_ >= 0) answer_waiting(connection_);
}

void UsbIpServer::unplug() {
  const std::scoped_lock lock(mutex_);
  if (connection_ >= 0) ::shutdown(connection_, SHUT_RDWR);
}

bool UsbIpServer::unlink(int connection, std::uint32_t number, std::uint32_t victim) {
  constexpr auto kWasReset = static_cast<std::uint32_t>(-104);
  const std::scoped_lock lock(mutex_);
  const auto removed = std::erase_if(waiting_, [victim](const Waiting& one) { return one.number == victim; });
  Bytes bytes;
  for (const std::uint32_t word : {4U, number, 0U, 0U, 0U, removed > 0 ? kWasReset : 0U})
    put_word(bytes, word);
  bytes.resize(48);
  return send_all(connection, bytes);
}

bool UsbIpServer::control(int connection, std::uint32_t number, bool in, std::size_t length,
                          std::span<const std::uint8_t> setup) {
  auto read = control_answer(device_->description(), setup);
  if (!read) return send_return(connection, number, kStall, {}, 0);
  read->resize(std::min(read->size(), length));
  return in ? send_return(connection, number, 0, *read, read->size())
            : send_return(connection, number, 0, {}, length);
}

bool UsbIpServer::submit(int connection, std::uint32_t number, bool in, std::uint32_t endpoint,
                         std::size_t length, std::span<const std::uint8_t> setup) {
  Bytes data(in ? 0 : length);
  if (!receive(connection, data)) return false;
  const std::scoped_lock lock(mutex_);
  if (endpoint == 0) return control(connection, number, in, length, setup);
  if (in)
    waiting_.push_back({number, endpoint, length});
  else if (!device_->out(endpoint, data) || !send_return(connection, number, 0, {}, length))
    return false;
  return answer_waiting(connection);
}

/// Reads of one endpoint are answered in their order.
bool UsbIpServer::answer_waiting(int connection) {
  std::set<unsigned> silent;  // endpoints that have nothing to say now
  for (auto one = waiting_.begin(); one != waiting_.end();) {
    const auto bytes =
        silent.contains(one->endpoint) ? std::nullopt : device_->in(one->endpoint, one->length);
    if (!bytes) {
      silent.insert(one->endpoint);
      ++one;
      continue;
    }
    if (!send_return(connection, one->number, 0, *bytes, bytes->size())) return false;
    one = waiting_.erase(one);
  }
  return true;
}

}  // namespace symrig::test
