// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/find_displays.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::projector::drm::test::edid_test {
namespace {

/// An EDID block with one descriptor, at place 0 to 3, of this type and text.
std::vector<std::byte> edid(std::size_t place, unsigned char type, const std::string& text) {
  std::vector<std::byte> bytes(128);
  std::fill(bytes.begin() + 1, bytes.begin() + 7, std::byte{0xFF});
  const std::size_t at = 54 + 18 * place;
  bytes[at + 3] = std::byte{type};
  for (std::size_t k = 0; k < text.size(); ++k) bytes[at + 5 + k] = static_cast<std::byte>(text[k]);
  return bytes;
}

TEST(Edid, a_name_stands_in_any_descriptor) {
  for (std::size_t place = 0; place < 4; ++place)
    EXPECT_EQ(display_name(edid(place, 0xFC, "DLPC350\n     ")), "DLPC350");
  EXPECT_EQ(display_name(edid(1, 0xFC, "ThirteenChars")), "ThirteenChars");
}

TEST(Edid, what_is_no_name_is_none) {
  EXPECT_EQ(display_name(edid(0, 0xFE, "free text\n")), "");
  EXPECT_EQ(display_name({}), "");
  auto bytes = edid(0, 0xFC, "name\n");
  bytes[0] = std::byte{1};
  EXPECT_EQ(display_name(bytes), "");
  bytes = edid(0, 0xFC, "name\n");
  bytes.resize(127);
  EXPECT_EQ(display_name(bytes), "");
}

TEST(Edid, nothing_in_a_name_can_move_a_cursor) {
  EXPECT_EQ(display_name(edid(2, 0xFC, "a\x1b[2J\xC3\n")), "a?[2J?");
}

}  // namespace
}  // namespace symrig::projector::drm::test::edid_test
