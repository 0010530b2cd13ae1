// SPDX-License-Identifier: Apache-2.0
#include "terminal_line.hpp"

#include <array>
#include <string>

#include <gtest/gtest.h>

namespace symrig::apps::terminal_line_test {
namespace {

TEST(TerminalLine, a_text_takes_its_letters_not_its_bytes) {
  EXPECT_EQ(columns_of("level 5"), 7U);
  EXPECT_EQ(columns_of("µs ±"), 4U);
  EXPECT_EQ(columns_of("日本"), 4U);
}

TEST(TerminalLine, is_cut_between_letters) {
  EXPECT_EQ(cut_to("µµµ", 2), "µµ");
  EXPECT_EQ(cut_to("日本", 3), "日");
  EXPECT_EQ(cut_to("abc", 0), "");
  EXPECT_EQ(cut_to("abc\xE6", 9), "abc\xE6");  // the rest of a letter is missing
}

TEST(TerminalLine, never_wider_than_asked_for) {
  const std::string text = "symrig capture: Größe 日本語 12 µs";
  for (std::size_t columns = 0; columns < 60; ++columns)
    EXPECT_LE(columns_of(cut_to(text, columns)), columns);
}

TEST(TerminalLine, says_the_longest_that_fits) {
  const std::array<std::string, 3> forms{"level 5, 12 of 318 photographs", "12 of 318 photographs",
                                         "12 of 318"};
  EXPECT_EQ(fitting(forms, 40), forms[0]);
  EXPECT_EQ(fitting(forms, 29), forms[1]);
  EXPECT_EQ(fitting(forms, 20), forms[2]);
  EXPECT_EQ(fitting(forms, 5), "12 of");
}

}  // namespace
}  // namespace symrig::apps::terminal_line_test
