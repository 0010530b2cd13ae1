// SPDX-License-Identifier: Apache-2.0
#include "symrig/protocol/crc32c.hpp"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace symrig::protocol::crc32c_test {
namespace {

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
}  // namespace symrig::protocol::crc32c_test
