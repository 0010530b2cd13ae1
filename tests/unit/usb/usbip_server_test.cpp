// SPDX-License-Identifier: Apache-2.0
// The server of USB devices, against bytes of the kernel's Documentation/usb/usbip_protocol.rst.
#include "usbip/usbip_server.hpp"

#include <array>
#include <string_view>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

namespace symrig::usbip_server_test {
namespace {

using Bytes = test::UsbDevice::Bytes;

/// Endpoint 1 returns what was written to it; endpoint 2 says what a test gives it.
class Echo final : public test::UsbDevice {
 public:
  Echo() {
    described_.name = "echo";
    described_.speed = test::UsbSpeed::super;
    described_.device = {18, 1, 0, 3, 0, 0, 0, 9, 0x09, 0x12, 0x02, 0x01, 0x34, 0x12, 1, 0, 0, 1};
    described_.configuration = {9, 2, 18, 0, 1, 1, 0, 0x80, 50, 9, 4, 0, 0, 0, 0xFF, 1, 2, 0};
    described_.strings = {"echo"};
    described_.interface_classes = {0xFF, 1, 2};
  }
  std::deque<Bytes> echoed, own;
  bool plugged = true;

  const test::UsbDescription& description() const override { return described_; }
  bool out(unsigned /*endpoint*/, std::span<const std::uint8_t> bytes) override {
    echoed.emplace_back(bytes.begin(), bytes.end());
    return plugged;
  }
  std::optional<Bytes> in(unsigned endpoint, std::size_t /*most*/) override {
    auto& queue = endpoint == 1 ? echoed : own;
    if (queue.empty()) return std::nullopt;
    Bytes bytes = queue.front();
    queue.pop_front();
    return bytes;
  }

 private:
  test::UsbDescription described_;
};

void put(Bytes& to, std::uint32_t value) {
  for (const unsigned shift : {24U, 16U, 8U, 0U}) to.push_back(static_cast<std::uint8_t>(value >> shift));
}

/// The kernel's side.
struct Kernel {
  Fd socket{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};

  explicit Kernel(const test::UsbIpServer& server) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(server.port());
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  }
  void send(const Bytes& bytes) const {
    EXPECT_EQ(::send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  /// So many bytes, or fewer if the other side closed.
  Bytes receive(std::size_t count) const {
    Bytes bytes(count);
    const ssize_t got = ::recv(socket.get(), bytes.data(), count, MSG_WAITALL);
    bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return bytes;
  }
  /// Imports the device: 8 bytes of reply, and 312 of the device.
  Bytes import() const {
    Bytes asked{0x01, 0x11, 0x80, 0x03, 0, 0, 0, 0, '1', '-', '1'};
    asked.resize(8 + 32);
    send(asked);
    return receive(8 + 312);
  }
  void submit(std::uint32_t number, bool in, std::uint32_t endpoint, std::uint32_t length, const Bytes& data,
              const Bytes& setup = Bytes(8)) const {
    Bytes bytes;
    for (const std::uint32_t word : {1U, number, 0x10001U, in ? 1U : 0U, endpoint, 0U, length, 0U, 0U, 0U})
      put(bytes, word);
    bytes.insert(bytes.end(), setup.begin(), setup.end());
    bytes.insert(bytes.end(), data.begin(), data.end());
    send(bytes);
  }
  void unlink(std::uint32_t number, std::uint32_t victim) const {
    Bytes bytes;
    for (const std::uint32_t word : {2U, number, 0x10001U, 0U, 0U, victim}) put(bytes, word);
    bytes.resize(48);
    send(bytes);
  }
};

/// What a reply of 48 bytes says: command, number, status, and the length that was moved.
std::array<std::uint32_t, 4> facts(const Bytes& reply) {
  const auto word = [&reply](std::size_t at) {
    return std::uint32_t{reply[at]} << 24U | std::uint32_t{reply[at + 1]} << 16U |
           std::uint32_t{reply[at + 2]} << 8U | reply[at + 3];
  };
  if (reply.size() != 48) return {};
  return {word(0), word(4), word(20), word(24)};
}
using Facts = std::array<std::uint32_t, 4>;

struct UsbIpServer : ::testing::Test {
  std::shared_ptr<Echo> device = std::make_shared<Echo>();
  test::UsbIpServer server{device, 0};
};

TEST_F(UsbIpServer, tells_the_device_as_its_descriptors_do) {
  ASSERT_NE(server.port(), 0);
  const Bytes told = Kernel(server).import();
  ASSERT_EQ(told.size(), 320U);
  EXPECT_EQ(Bytes(told.begin(), told.begin() + 8), Bytes({0x01, 0x11, 0, 3, 0, 0, 0, 0}));
  EXPECT_EQ(std::string(told.begin() + 8, told.begin() + 32), "/sys/devices/symrig/echo");
  EXPECT_EQ(
      Bytes(told.end() - 24, told.end()),
      Bytes({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 5, 0x12, 0x09, 0x01, 0x02, 0x12, 0x34, 0, 0, 0, 1, 1, 1}));
}

TEST_F(UsbIpServer, answers_standard_requests_and_stalls_others) {
  const Kernel kernel(server);
  kernel.import();
  kernel.submit(1, true, 0, 18, {}, {0x80, 6, 0, 1, 0, 0, 18, 0});
  EXPECT_EQ(facts(kernel.receive(48)), (Facts{3, 1, 0, 18}));
  EXPECT_EQ(kernel.receive(18), device->description().device);
  kernel.submit(2, true, 0, 255, {}, {0x80, 6, 1, 3, 9, 4, 255, 0});
  EXPECT_EQ(facts(kernel.receive(48)), (Facts{3, 2, 0, 10}));
  EXPECT_EQ(kernel.receive(10), Bytes({10, 3, 'e', 0, 'c', 0, 'h', 0, 'o', 0}));
  kernel.submit(3, true, 0, 255, {}, {0x80, 6, 0, 0x22, 0, 0, 255, 0});
  EXPECT_EQ(facts(kernel.receive(48)), (Facts{3, 3, static_cast<std::uint32_t>(-32), 0}));
  kernel.submit(4, false, 0, 0, {}, {0, 9, 1, 0, 0, 0, 0, 0});
  EXPECT_EQ(facts(kernel.receive(48)), (Facts{3, 4, 0, 0}));
}

TEST_F(UsbIpServer, a_read_waits_without_holding_up_other_endpoints) {
  const Kernel kernel(server);
  kernel.import();
  kernel.submit(1, true, 2, 64, {});
  kernel.submit(2, true, 1, 64, {});
  kernel.submit(3, false, 1, 2, {5, 6});
  EXPECT_EQ(facts(kernel.receive(48)), (Facts{3, 3, 0, 2}));
  EXPECT_EQ(facts(kernel.receive(48)), (Facts{3, 2, 0, 2}));
  EXPECT_EQ(kernel.receive(2), Bytes({5, 6}));
  {
    const std::scoped_lock lock(server.mutex());
    device->own.push_back({7});
  }
  server.answer();
  EXPECT_EQ(facts(kernel.receive(48)), (Facts{3, 1, 0, 1}));
  EXPECT_EQ(kernel.receive(1), Bytes({7}));
}

TEST_F(UsbIpServer, a_read_that_is_taken_back_gets_nothing_later) {
  const Kernel kernel(server);
  kernel.import();
  kernel.submit(1, true, 2, 64, {});
  kernel.unlink(2, 1);
  EXPECT_EQ(facts(kernel.receive(48)), (Facts{4, 2, static_cast<std::uint32_t>(-104), 0}));
  {
    const std::scoped_lock lock(server.mutex());
    device->own.push_back({7});
  }
  server.answer();
  kernel.submit(3, true, 2, 64, {});
  EXPECT_EQ(facts(kernel.receive(48)), (Facts{3, 3, 0, 1})) << "the next read gets it";
  EXPECT_EQ(kernel.receive(1), Bytes({7}));
  kernel.unlink(4, 3);
  EXPECT_EQ(facts(kernel.receive(48)), (Facts{4, 4, 0, 0})) << "too late";
}

TEST_F(UsbIpServer, an_unplugged_device_closes_the_line_and_can_come_back) {
  {
    const Kernel kernel(server);
    kernel.import();
    kernel.submit(1, true, 2, 64, {});
    kernel.submit(2, true, 0, 18, {}, {0x80, 6, 0, 1, 0, 0, 18, 0});
    EXPECT_EQ(kernel.receive(48 + 18).size(), 66U);
    server.unplug();
    EXPECT_EQ(kernel.receive(48), Bytes{});
  }
  const Kernel again(server);
  EXPECT_EQ(again.import().size(), 320U);
  {
    const std::scoped_lock lock(server.mutex());
    device->own.push_back({7});
    device->plugged = false;
  }
  server.answer();
  again.submit(1, false, 1, 1, {9});
  EXPECT_EQ(again.receive(48), Bytes{}) << "neither a read of the last connection nor a device that is gone";
}

}  // namespace
}  // namespace symrig::usbip_server_test
