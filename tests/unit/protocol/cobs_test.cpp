// SPDX-License-Identifier: Apache-2.0
#include "symrig/protocol/cobs.hpp"

#include "random_program.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace symrig::protocol::cobs_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

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

}  // namespace
}  // namespace symrig::protocol::cobs_test
