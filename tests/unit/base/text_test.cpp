// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/text.hpp"

#include <array>
#include <string>

#include <gtest/gtest.h>

namespace symrig::nearest_name_test {
namespace {

constexpr std::array<std::string_view, 8> kWords{"capture", "relight", "letters", "version",
                                                 "rig",     "size",    "gummy",   "vgroove-white"};

std::string meant(std::string_view given) {
  return std::string(nearest_name(given, kWords).value_or(""));
}

TEST(NearestName, counts_edits) {
  EXPECT_EQ(edit_distance("", ""), 0U);
  EXPECT_EQ(edit_distance("abc", ""), 3U);
  EXPECT_EQ(edit_distance("gain", "gian"), 1U);  // neighbours exchanged
  EXPECT_EQ(edit_distance("size", "sise"), 1U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
}

TEST(NearestName, finds_what_is_one_slip_away) {
  const std::array<std::pair<const char*, const char*>, 9> slips{{{"captur", "capture"},
                                                                  {"cpature", "capture"},
                                                                  {"Capture", "capture"},
                                                                  {"versoin", "version"},
                                                                  {"rgi", "rig"},
                                                                  {"lettres", "letters"},
                                                                  {"sise", "size"},
                                                                  {"gumy", "gummy"},
                                                                  {"groove", "vgroove-white"}}};
  for (const auto& [given, known] : slips) EXPECT_EQ(meant(given), known) << given;
}

// A guess that is far off sends people the wrong way.
TEST(NearestName, says_nothing_where_nothing_is_near) {
  for (const char* given : {"", "x", "nonsense", "laser", "qqqqqqq", "--"})
    EXPECT_EQ(meant(given), "") << given;
  EXPECT_EQ(meant(std::string(100'000, 'a')), "");
}

TEST(NearestName, the_hint_lists_all_that_are_known) {
  EXPECT_EQ(nearest_hint("rgi", std::span(kWords).subspan(3, 3)),
            "did you mean 'rig'? known: version, rig, size");
  EXPECT_EQ(nearest_hint("laser", std::span(kWords).subspan(3, 2)), "known: version, rig");
  EXPECT_EQ(nearest_hint("laser", std::span<const std::string_view>()), "there are none");
}

}  // namespace
}  // namespace symrig::nearest_name_test
