// SPDX-License-Identifier: Apache-2.0

#include "bench.hpp"
#include "symrig/board/link.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/protocol/messages.hpp"
#include "unit/protocol/random_program.hpp"

#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::sim_link_test {
namespace {

TEST(SimLink, waits_no_shorter_than_asked) {
  board_sim::SimBoardConfig config;
  config.tick_hz = 1'000'000;
  board_sim::SimBoard board(config);
  const auto link = make_sim_link(board);
  for (const std::int64_t wait : {1, 333, 499, 1000, 1499, 2'000'001}) {
    const Nanoseconds before = link->now();
    ASSERT_TRUE(link->receive(Nanoseconds(wait)).ok());
    EXPECT_GE((link->now() - before).count(), wait);
    EXPECT_LE((link->now() - before).count(), wait + 1000);  // one tick
  }
}

}  // namespace
}  // namespace symrig::sim_link_test

// A board that receives only short frames: it says so in its capabilities, and the host keeps to it.

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

// A capture over links that lose, repeat, damage and delay bytes gives the receipt of a clean one.

namespace symrig::noisy_link_test {
namespace {

using namespace std::chrono_literals;

struct Noise {
  std::uint64_t seed = 0;
  unsigned lose = 0;    // percent of frames (runs of bytes up to a zero)
  unsigned repeat = 0;  //
  unsigned damage = 0;  // one bit flipped
  unsigned cut = 0;     // the end missing, closing zero included
};

class NoisyLink final : public Link {
 public:
  NoisyLink(std::unique_ptr<Link> link, Noise noise)
      : link_(std::move(link)), noise_(noise), random_(noise.seed) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override { return link_->send(spoil(bytes)); }
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override {
    SYMRIG_TRY(const auto bytes, link_->receive(timeout));
    return spoil(bytes);
  }
  Nanoseconds now() const override { return link_->now(); }

  int spoiled() const { return spoiled_; }

 private:
  std::vector<std::uint8_t> spoil(std::span<const std::uint8_t> bytes) {
    std::vector<std::uint8_t> out;
    std::vector<std::uint8_t> frame;
    for (const std::uint8_t byte : bytes) {
      frame.push_back(byte);
      if (byte != 0) continue;
      spoil_frame(frame, out);
      frame.clear();
    }
    out.insert(out.end(), frame.begin(), frame.end());
    return out;
  }

  void spoil_frame(std::vector<std::uint8_t> frame, std::vector<std::uint8_t>& out) {
    const bool lose = random_.chance(noise_.lose);
    const bool repeat = random_.chance(noise_.repeat);
    if (random_.chance(noise_.damage)) {
      frame[random_.range(0, frame.size() - 1)] ^= static_cast<std::uint8_t>(1U << random_.range(0, 7));
      ++spoiled_;
    }
    if (random_.chance(noise_.cut)) {
      frame.resize(random_.range(0, frame.size() - 1));
      ++spoiled_;
    }
    spoiled_ += static_cast<int>(lose) + static_cast<int>(repeat);
    if (lose) return;
    out.insert(out.end(), frame.begin(), frame.end());
    if (repeat) out.insert(out.end(), frame.begin(), frame.end());
  }

  std::unique_ptr<Link> link_;
  Noise noise_;
  symrig::test::Random random_;
  int spoiled_ = 0;
};

/// A capture of 40 brackets over a link with that noise.
void capture_over(const Noise& noise) {
  test::Bench bench;
  auto link = std::make_unique<NoisyLink>(make_sim_link(bench.sim), noise);
  const NoisyLink& spy = *link;
  BoardOptions options;
  options.attempts = 40;  // a quarter of all frames spoiled each way: 0.44^40 is never
  options.reply_timeout = 10ms;
  auto board = Board::connect(std::move(link), options);
  ASSERT_OK(board);
  const std::vector<LineConfig> lines{{.line = "camera_strobe", .capture = true}};
  ASSERT_OK(board->configure(lines));
  std::vector<std::vector<Nanoseconds>> brackets(40, {100us, 800us, 6400us, 25600us});
  for (std::size_t i = 0; i < brackets.size(); ++i) brackets[i][0] += i * 1us;  // none is like the one before
  const auto compiled = compile_brackets(default_rig_setup(), board->info(), brackets);
  ASSERT_OK(compiled);
  ASSERT_GT(compiled->program.bytes().size(), 8U * 480U);  // more chunks than the window holds
  const auto receipt = board->run(compiled->program, 600s);
  ASSERT_OK(receipt);
  EXPECT_TRUE(receipt->clean());
  EXPECT_EQ(receipt->events_lost, 0U);
  EXPECT_EQ(receipt->marks.size(), 200U);
  EXPECT_EQ(receipt->edges.size(), 320U);
  for (std::size_t k = 0; k < receipt->marks.size(); ++k) EXPECT_EQ(receipt->marks[k].ordinal, k);
  EXPECT_EQ(bench.camera.frames().size(), 160U);
  EXPECT_EQ(bench.projector.changes().size(), 40U);  // the run was started once
  const bool noisy = noise.lose + noise.repeat + noise.damage + noise.cut > 0;
  EXPECT_GE(spy.spoiled(), noisy ? 20 : 0);
}

TEST(NoisyLink, clean) {
  capture_over({});
}
TEST(NoisyLink, losing_frames) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) capture_over({.seed = seed, .lose = 15});
}
TEST(NoisyLink, repeating_frames) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) capture_over({.seed = seed, .repeat = 30});
}
TEST(NoisyLink, damaging_frames) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) capture_over({.seed = seed, .damage = 15});
}
TEST(NoisyLink, cutting_frames) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) capture_over({.seed = seed, .cut = 10});
}
TEST(NoisyLink, everything_at_once) {
  for (std::uint64_t seed = 0; seed < 20; ++seed)
    capture_over({.seed = seed, .lose = 8, .repeat = 8, .damage = 8, .cut = 4});
}

/// A question that is sent again is dated by its first sending, whichever answer comes: the clock's bound
/// holds. Here board and host share a clock, so that the truth is known.
TEST(NoisyLink, the_clock_is_bounded) {
  test::Bench bench;
  auto link = std::make_unique<NoisyLink>(
      make_sim_link(bench.sim), Noise{.seed = 5, .lose = 30, .repeat = 20, .damage = 10, .cut = 10});
  BoardOptions options;
  options.attempts = 60;
  options.reply_timeout = 10ms;
  auto board = Board::connect(std::move(link), options);
  ASSERT_OK(board);
  ClockModel model(board->info().rate);
  int repeated = 0;
  for (int k = 0; k < 200; ++k) {
    const auto reading = board->time();
    ASSERT_OK(reading);
    repeated += reading->received - reading->sent >= 10ms ? 1 : 0;
    ASSERT_OK(model.add(*reading));
    ASSERT_OK(board->idle(7ms));
    const std::uint64_t truth = bench.sim.now();
    const auto estimate = model.board_at({board->info().rate.nanoseconds({truth})});
    ASSERT_OK(estimate);
    const auto off = static_cast<std::int64_t>(estimate->at.since.count - truth);
    ASSERT_LE(static_cast<std::uint64_t>(std::abs(off)), estimate->bound.count);
  }
  EXPECT_GT(repeated, 50);  // six of ten exchanges are spoiled
}

}  // namespace
}  // namespace symrig::noisy_link_test
