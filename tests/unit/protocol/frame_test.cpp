// SPDX-License-Identifier: Apache-2.0
#include "symrig/protocol/frame.hpp"

#include "random_program.hpp"
#include "symrig/protocol/cobs.hpp"
#include "symrig/protocol/crc32c.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace symrig::protocol::frame_test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Event = FrameDecoder::Event;

struct Sent {
  FrameHeader header;
  Bytes body;
};

Sent random_frame(test::Random& random) {
  Sent sent;
  sent.header = {static_cast<std::uint8_t>(random.next()),  static_cast<Kind>(random.range(1, 6)),
                 static_cast<std::uint16_t>(random.next()), static_cast<std::uint16_t>(random.next()),
                 static_cast<std::uint8_t>(random.next()),  static_cast<std::uint8_t>(random.next())};
  sent.body.resize(random.chance(10) ? kMaxBody : random.range(0, 40));
  for (std::uint8_t& byte : sent.body)
    byte = random.chance(25) ? 0 : static_cast<std::uint8_t>(random.next());
  return sent;
}

Bytes wire_of(const Sent& sent) {
  Bytes wire(kMaxWire);
  wire.resize(encode_frame(sent.header, {sent.body.data(), sent.body.size()}, {wire.data(), wire.size()}));
  return wire;
}

bool same(const Frame& frame, const Sent& sent) {
  return frame.header.proto_major == sent.header.proto_major && frame.header.kind == sent.header.kind &&
         frame.header.seq == sent.header.seq && frame.header.ack == sent.header.ack &&
         frame.header.credit == sent.header.credit && frame.header.flags == sent.header.flags &&
         std::equal(sent.body.begin(), sent.body.end(), frame.body.data, frame.body.data + frame.body.size);
}

/// Pushes all bytes; returns how many frames came out.
int push_all(FrameDecoder& decoder, const Bytes& bytes) {
  return static_cast<int>(std::count_if(
      bytes.begin(), bytes.end(), [&](std::uint8_t byte) { return decoder.push(byte) == Event::frame; }));
}

TEST(Frame, round_trip) {
  EXPECT_TRUE(rc::check([](std::uint64_t seed) {
    test::Random random(seed);
    FrameDecoder decoder;
    for (int i = 0; i < 10; ++i) {
      const Sent sent = random_frame(random);
      const Bytes wire = wire_of(sent);
      RC_ASSERT(!wire.empty());
      RC_ASSERT(push_all(decoder, wire) == 1);
      RC_ASSERT(same(decoder.frame(), sent));
    }
  }));
}

TEST(Frame, largest_body_fits_and_one_more_does_not) {
  Sent sent;
  sent.body.assign(kMaxBody, 0x55);
  EXPECT_FALSE(wire_of(sent).empty());
  EXPECT_LE(wire_of(sent).size(), kMaxWire);
  sent.body.push_back(0x55);
  EXPECT_TRUE(wire_of(sent).empty());
}

TEST(Frame, one_flipped_bit_never_passes) {
  EXPECT_TRUE(rc::check([](std::uint64_t seed) {
    test::Random random(seed);
    const Sent sent = random_frame(random);
    Bytes wire = wire_of(sent);
    wire[random.range(0, wire.size() - 1)] ^= static_cast<std::uint8_t>(1U << random.range(0, 7));
    wire.push_back(0);  // in case the closing zero was hit
    FrameDecoder decoder;
    RC_ASSERT(push_all(decoder, wire) == 0);
  }));
}

TEST(Frame, a_sound_frame_after_garbage_is_found_at_the_next_zero) {
  EXPECT_TRUE(rc::check([](const Bytes& garbage, std::uint64_t seed) {
    test::Random random(seed);
    const Sent sent = random_frame(random);
    FrameDecoder decoder;
    push_all(decoder, garbage);
    decoder.push(0);
    RC_ASSERT(push_all(decoder, wire_of(sent)) == 1);
    RC_ASSERT(same(decoder.frame(), sent));
  }));
}

TEST(Frame, a_cut_frame_costs_at_most_the_next_one) {
  EXPECT_TRUE(rc::check([](std::uint64_t seed) {
    test::Random random(seed);
    const Bytes cut = wire_of(random_frame(random));
    const Sent second = random_frame(random);
    FrameDecoder decoder;
    push_all(decoder,
             Bytes(cut.begin(), cut.begin() + static_cast<std::ptrdiff_t>(random.range(0, cut.size() - 1))));
    push_all(decoder, wire_of(random_frame(random)));
    RC_ASSERT(push_all(decoder, wire_of(second)) == 1);
    RC_ASSERT(same(decoder.frame(), second));
  }));
}

/// What push() says at the closing zero of `wire`.
Event verdict(const Bytes& wire) {
  FrameDecoder decoder;
  Event last = Event::none;
  for (const std::uint8_t byte : wire) last = decoder.push(byte);
  return last;
}

Bytes closed(const Bytes& plain) {
  Bytes wire(cobs_bound(plain.size()) + 1);
  wire.resize(cobs_encode({plain.data(), plain.size()}, {wire.data(), wire.size()}));
  wire.push_back(0);
  return wire;
}

Bytes with_crc(Bytes plain) {
  const std::uint32_t crc = crc32c({plain.data(), plain.size()});
  plain.resize(plain.size() + 4);
  put_u32(plain.data() + plain.size() - 4, crc);
  return plain;
}

TEST(Frame, each_way_of_being_wrong_has_its_name) {
  EXPECT_EQ(verdict({0, 0, 0}), Event::none);
  EXPECT_EQ(verdict({5, 1, 2, 0}), Event::bad_cobs);
  EXPECT_EQ(verdict(closed(Bytes(11, 1))), Event::too_short);
  EXPECT_EQ(verdict(closed(Bytes(kMtu + 1, 1))), Event::too_long);
  EXPECT_EQ(verdict(closed(Bytes(12, 1))), Event::bad_crc);
  EXPECT_EQ(verdict(closed(with_crc({1, 7, 0, 0, 0, 0, 0, 0}))), Event::bad_kind);
  EXPECT_EQ(verdict(closed(with_crc({1, 0, 0, 0, 0, 0, 0, 0}))), Event::bad_kind);
  EXPECT_EQ(verdict(closed(with_crc({1, 6, 0, 0, 0, 0, 0, 0}))), Event::frame);
}

TEST(Frame, sequence_numbers_compare_round_the_circle) {
  EXPECT_TRUE(seq_before(0, 1));
  EXPECT_TRUE(seq_before(0xFFFF, 0));
  EXPECT_TRUE(seq_before(0xFFF0, 0x0010));
  EXPECT_FALSE(seq_before(1, 0));
  EXPECT_FALSE(seq_before(5, 5));
  EXPECT_TRUE(seq_before(0, 0x7FFF));
  EXPECT_FALSE(seq_before(0, 0x8000));
}

Bytes encode(const Bytes& plain) {
  Bytes out(cobs_bound(plain.size()));
  out.resize(cobs_encode({plain.data(), plain.size()}, {out.data(), out.size()}));
  return out;
}

/// The definition read backwards: each code byte leads code - 1 bytes, and stands for a zero after them
/// unless it is 255 or nothing follows.
Bytes decode(const Bytes& wire) {
  Bytes plain;
  for (std::size_t at = 0; at < wire.size();) {
    const std::size_t code = wire[at];
    plain.insert(plain.end(), wire.begin() + static_cast<std::ptrdiff_t>(at + 1),
                 wire.begin() + static_cast<std::ptrdiff_t>(at + code));
    at += code;
    if (code < 255 && at < wire.size()) plain.push_back(0);
  }
  return plain;
}

/// Bytes of a length that reaches over the 254-byte blocks, with zeros rare, common or absent.
Bytes interesting_bytes(std::uint64_t seed) {
  test::Random random(seed);
  const unsigned zeros = static_cast<unsigned>(random.range(0, 2)) * 30;
  Bytes bytes(random.range(0, 600));
  for (std::uint8_t& byte : bytes)
    byte = random.chance(zeros) ? 0 : static_cast<std::uint8_t>(random.range(1, 255));
  return bytes;
}

TEST(Cobs, round_trip_without_zeros_on_the_wire) {
  EXPECT_TRUE(rc::check([](std::uint64_t seed) {
    const Bytes plain = interesting_bytes(seed);
    const Bytes wire = encode(plain);
    RC_ASSERT(std::count(wire.begin(), wire.end(), 0) == 0);
    RC_ASSERT(wire.size() <= cobs_bound(plain.size()));
    RC_ASSERT(decode(wire) == plain);
  }));
}

TEST(Cobs, every_length_around_the_block_size) {
  for (std::size_t length = 0; length <= 520; ++length) {
    const Bytes plain(length, 0xAB);
    EXPECT_EQ(decode(encode(plain)), plain) << length;
  }
}

TEST(Cobs, refuses_room_that_may_not_suffice) {
  const Bytes plain(10, 1);
  Bytes out(cobs_bound(plain.size()) - 1);
  EXPECT_EQ(cobs_encode({plain.data(), plain.size()}, {out.data(), out.size()}), 0U);
}

/// Bit by bit, as the polynomial 0x1EDC6F41 is written down (reflected).
std::uint32_t slow_crc32c(const std::vector<std::uint8_t>& bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes)
    for (unsigned bit = 0; bit < 8; ++bit) {
      const std::uint32_t feedback = (crc ^ (static_cast<std::uint32_t>(byte) >> bit)) & 1U;
      crc = (crc >> 1U) ^ (feedback != 0 ? 0x82F63B78U : 0U);
    }
  return ~crc;
}

TEST(Crc32c, check_value) {
  const std::vector<std::uint8_t> digits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(crc32c({digits.data(), digits.size()}), 0xE3069283U);
  EXPECT_EQ(crc32c({}), 0U);
}

TEST(Crc32c, agrees_with_the_bitwise_definition) {
  EXPECT_TRUE(rc::check([](const std::vector<std::uint8_t>& bytes) {
    RC_ASSERT(crc32c({bytes.data(), bytes.size()}) == slow_crc32c(bytes));
  }));
}

TEST(Crc32c, can_be_fed_in_parts) {
  EXPECT_TRUE(rc::check([](const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
    std::vector<std::uint8_t> both = a;
    both.insert(both.end(), b.begin(), b.end());
    Crc32c crc;
    crc.add({a.data(), a.size()});
    crc.add({b.data(), b.size()});
    RC_ASSERT(crc.value() == crc32c({both.data(), both.size()}));
  }));
}

}  // namespace
}  // namespace symrig::protocol::frame_test
