// SPDX-License-Identifier: Apache-2.0
#include "assert_ok.hpp"
#include "scratch.hpp"
#include "socket_transport.hpp"
#include "symrig/protocol/messages.hpp"
#include "transport.hpp"

#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace symrig::board_linux::test::links_test {
namespace {

using protocol::Kind;

std::vector<std::uint8_t> request(std::uint16_t seq, std::uint8_t flags) {
  symrig_wire_Request hello = symrig_wire_Request_init_zero;
  hello.which_body = symrig_wire_Request_hello_tag;
  protocol::BodyBuffer body{};
  const std::size_t size = encode(hello, body);
  std::vector<std::uint8_t> wire(protocol::kMaxWire);
  wire.resize(protocol::encode_frame({protocol::kProtoMajor, Kind::request, seq, 0, 0, flags},
                                     {body.bytes, size}, {wire.data(), wire.size()}));
  return wire;
}

protocol::Frame decoded(protocol::FrameDecoder& decoder, protocol::ByteView wire) {
  for (std::size_t k = 0; k < wire.size; ++k)
    if (decoder.push(wire.data[k]) == protocol::FrameDecoder::Event::frame) return decoder.frame();
  ADD_FAILURE() << "no frame";
  return {};
}

TEST(BusyAnswer, AnswersTheFirstRequestByCode19) {
  protocol::BusyAnswer busy;
  const auto bytes = request(41, protocol::flag::sync);
  EXPECT_EQ(busy.take({bytes.data(), 5}).size, 0U) << "half a request";
  protocol::FrameDecoder decoder;
  const protocol::Frame frame = decoded(decoder, busy.take({bytes.data() + 5, bytes.size() - 5}));
  EXPECT_EQ(frame.header.kind, Kind::reply);
  EXPECT_EQ(frame.header.ack, 42);
  symrig_wire_Reply reply = symrig_wire_Reply_init_zero;
  ASSERT_TRUE(protocol::decode(frame.body, reply));
  EXPECT_EQ(protocol::raw(reply.code), static_cast<std::uint32_t>(symrig_wire_Code_CODE_BUSY));
}

TEST(BusyAnswer, AnUrgentRequestGetsItsTokenBack) {
  protocol::BusyAnswer busy;
  protocol::FrameDecoder decoder;
  const auto bytes = request(41, protocol::flag::urgent);
  const protocol::Frame frame = decoded(decoder, busy.take({bytes.data(), bytes.size()}));
  EXPECT_EQ(frame.header.ack, 41);
  EXPECT_EQ(frame.header.flags & protocol::flag::urgent, protocol::flag::urgent);
}

/// A way to the host in memory.
class Wire final : public BufferedTransport {
 public:
  explicit Wire(std::string name) : name_(std::move(name)) {}
  const std::string& name() const override { return name_; }
  void watch(std::vector<pollfd>&) const override {}
  void serve() override {}
  bool attached() const override { return attached_; }
  void flush() override {
    sent.insert(sent.end(), out_.begin(), out_.end());
    out_.clear();
  }
  void come(const std::vector<std::uint8_t>& bytes) { in_ = bytes; }
  void attach(bool there) {
    attached_ = there;
    if (!there) forget();
  }

  std::vector<std::uint8_t> sent;

 private:
  std::string name_;
  bool attached_ = true;
};

class Links : public testing::Test {
 protected:
  Links() {
    auto first = std::make_unique<Wire>("first");
    auto second = std::make_unique<Wire>("second");
    first_ = first.get();
    second_ = second.get();
    std::vector<std::unique_ptr<Transport>> both;
    both.push_back(std::move(first));
    both.push_back(std::move(second));
    links_.emplace(std::move(both));
  }
  std::size_t read() {
    std::array<std::uint8_t, 64> bytes{};
    return links_->read(bytes.data(), bytes.size());
  }

  Wire* first_ = nullptr;
  Wire* second_ = nullptr;
  std::optional<LinkSwitch> links_;
  static constexpr hal::Tick kSecond = 1'000'000'000;
};

TEST_F(Links, WhoSpeaksFirstHasTheBoard) {
  EXPECT_FALSE(links_->attached()) << "a cable is no host yet";
  EXPECT_FALSE(links_->serve(0));
  second_->come({1, 2, 3});
  EXPECT_TRUE(links_->serve(1));
  EXPECT_EQ(links_->holder(), "second");
  EXPECT_TRUE(links_->attached());
  EXPECT_EQ(read(), 3U) << "nothing of what it said is lost";
}

TEST_F(Links, AnotherIsToldAndTheFirstIsNotDisturbed) {
  first_->come({1});
  links_->serve(0);
  second_->come(request(7, protocol::flag::sync));
  links_->serve(kSecond);
  EXPECT_EQ(links_->holder(), "first");
  protocol::FrameDecoder decoder;
  EXPECT_EQ(decoded(decoder, {second_->sent.data(), second_->sent.size()}).header.ack, 8);
  EXPECT_TRUE(first_->sent.empty());
  EXPECT_EQ(read(), 1U);
}

TEST_F(Links, TheBoardSeesThatAHostHasGone) {
  first_->come({1});
  links_->serve(0);
  first_->attach(false);
  second_->come({2, 2});
  EXPECT_TRUE(links_->serve(1));
  EXPECT_FALSE(links_->attached()) << "one poll without a host, before the next one";
  EXPECT_TRUE(links_->serve(2));
  EXPECT_EQ(links_->holder(), "second");
  EXPECT_EQ(read(), 2U);
}

TEST_F(Links, ASilentOneGivesWay) {
  first_->come({1});
  links_->serve(0);
  read();
  second_->come({2});
  links_->serve(4 * kSecond);
  EXPECT_EQ(links_->holder(), "first") << "not yet";
  second_->come({2});
  EXPECT_TRUE(links_->serve(5 * kSecond));
  EXPECT_FALSE(links_->attached());
  links_->serve(5 * kSecond);
  EXPECT_EQ(links_->holder(), "second");
}

// Where symrigd puts its socket: only a socket of before is replaced.

using symrig::test::Scratch;

TEST(SocketPlace, a_file_in_the_place_of_the_socket_stays) {
  const Scratch folder;
  std::ofstream(folder / "board.sock") << "of somebody else";
  const auto refused = SocketTransport::listen_unix(folder / "board.sock");
  EXPECT_FALSE(refused.ok());
  std::stringstream text;
  text << std::ifstream(folder / "board.sock").rdbuf();
  EXPECT_EQ(text.str(), "of somebody else");
}

TEST(SocketPlace, a_socket_that_nobody_serves_is_replaced) {
  const Scratch folder;
  {
    const auto first = SocketTransport::listen_unix(folder / "board.sock");
    ASSERT_TRUE(first.ok());
    std::filesystem::create_hard_link(folder / "board.sock", folder / "left.sock");
  }
  EXPECT_TRUE(SocketTransport::listen_unix(folder / "left.sock").ok());
}

}  // namespace
}  // namespace symrig::board_linux::test::links_test
