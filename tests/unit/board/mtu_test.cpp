// SPDX-License-Identifier: Apache-2.0
// A board that receives only short frames: it says so in its capabilities, and the host keeps to it.
#include "bench.hpp"
#include "symrig/protocol/messages.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::mtu_test {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

/// Before a simulated board: advertises a smaller MTU, and drops longer frames as such a board does.
class ShortFrames final : public Link {
 public:
  ShortFrames(std::unique_ptr<Link> link, std::uint32_t mtu, std::size_t& dropped, std::size_t& longest)
      : link_(std::move(link)), mtu_(mtu), dropped_(dropped), longest_(longest) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override {
    Bytes kept;
    for (const std::uint8_t byte : bytes) {
      frame_.push_back(byte);
      if (byte != 0) continue;
      if (fits()) kept.insert(kept.end(), frame_.begin(), frame_.end());
      frame_.clear();
    }
    return link_->send(kept);
  }
  Result<Bytes> receive(Nanoseconds timeout) override {
    SYMRIG_TRY(const Bytes bytes, link_->receive(timeout));
    Bytes out;
    for (const std::uint8_t byte : bytes)
      if (from_board_.push(byte) == protocol::FrameDecoder::Event::frame) pass(from_board_.frame(), out);
    return out;
  }
  Nanoseconds now() const override { return link_->now(); }

 private:
  bool fits() {
    protocol::FrameDecoder decoder;
    for (const std::uint8_t byte : frame_) {
      if (decoder.push(byte) != protocol::FrameDecoder::Event::frame) continue;
      const std::size_t size = protocol::kHeaderSize + decoder.frame().body.size + protocol::kCrcSize;
      longest_ = std::max(longest_, size);
      if (size > mtu_) ++dropped_;
      return size <= mtu_;
    }
    return true;
  }
  void pass(const protocol::Frame& frame, Bytes& out) const {
    Bytes body(frame.body.data, frame.body.data + frame.body.size);
    symrig_wire_Reply reply;
    if (frame.header.kind == protocol::Kind::reply && protocol::decode(frame.body, reply) &&
        reply.which_body == symrig_wire_Reply_capabilities_tag) {
      reply.body.capabilities.mtu = mtu_;
      protocol::BodyBuffer buffer{};
      body.assign(buffer.bytes, buffer.bytes + encode(reply, buffer));
    }
    std::array<std::uint8_t, protocol::kMaxWire> wire{};
    const std::size_t size =
        protocol::encode_frame(frame.header, {body.data(), body.size()}, {wire.data(), wire.size()});
    out.insert(out.end(), wire.begin(), wire.begin() + static_cast<std::ptrdiff_t>(size));
  }

  std::unique_ptr<Link> link_;
  std::uint32_t mtu_;
  std::size_t& dropped_;
  std::size_t& longest_;
  Bytes frame_;
  protocol::FrameDecoder from_board_;
};

TEST(Mtu, a_host_sends_no_frame_that_is_longer_than_the_board_receives) {
  for (const std::uint32_t mtu : {128U, 131U, 200U, 511U, 512U}) {
    test::Bench bench;
    std::size_t dropped = 0;
    std::size_t longest = 0;
    Board board =
        test::Bench::connect(std::make_unique<ShortFrames>(make_sim_link(bench.sim), mtu, dropped, longest));
    EXPECT_EQ(board.info().mtu, mtu);
    ASSERT_OK(board.configure({}));
    ProgramBuilder builder(board.info());
    for (std::uint64_t k = 0; k < 301; ++k) builder.set("lamp_enable", k % 2 == 0).hold(Ticks{2000 + k});
    const auto program = builder.set("lamp_enable", false).end();
    ASSERT_OK(program);
    const auto receipt = board.run(*program, 5s);
    ASSERT_OK(receipt);
    EXPECT_EQ(receipt->end, RunEnd::completed) << mtu;
    EXPECT_EQ(dropped, 0U) << mtu;
    EXPECT_GT(longest + 8, mtu & ~7U) << "room is used";
  }
}

TEST(Mtu, a_board_without_room_for_requests_is_refused) {
  test::Bench bench;
  std::size_t dropped = 0;
  std::size_t longest = 0;
  const auto board =
      Board::connect(std::make_unique<ShortFrames>(make_sim_link(bench.sim), 100, dropped, longest));
  ASSERT_FALSE(board);
  EXPECT_EQ(board.error().code, ErrorCode::protocol);
}

}  // namespace
}  // namespace symrig::mtu_test
