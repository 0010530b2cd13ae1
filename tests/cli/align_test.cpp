// SPDX-License-Identifier: Apache-2.0
// `symrig align` away from a terminal: lines for a log, and lines of JSON.
#include "command.hpp"

#include <csignal>
#include <sstream>

namespace symrig::test::align_test {
namespace {

using Align = CommandTest;

constexpr const char* kGood = "sim:plane?size=24x24&fine=4&camera=96x96&turn=2&zoom=0.9";
/// The camera has too few pixels, and does not see all cells.
constexpr const char* kBad = "sim:plane?size=24x24&fine=4&camera=40x40&turn=2&shift=5,0";

std::vector<nlohmann::json> lines_of(const std::string& text) {
  std::vector<nlohmann::json> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

TEST_F(Align, ends_when_the_rig_was_good_enough_twice) {
  const Outcome outcome = symrig({"align", "--rig", kGood, "--json", "a.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("update 2: cells seen 100.00 %"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("good enough"), std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.out.find("update 3"), std::string::npos) << outcome.out;
  const auto lines = lines_of(read_text(path("a.json")));
  ASSERT_EQ(lines.size(), 2U);
  for (const nlohmann::json& line : lines) {
    EXPECT_EQ(line.at("good"), true);
    EXPECT_EQ(line.at("cells"), nlohmann::json::array({24, 24}));
    EXPECT_NEAR(line.at("turn").get<double>(), 2, 0.5);
    EXPECT_NEAR(line.at("pixels_per_cell").get<double>(), 3.6, 0.05);
    EXPECT_EQ(line.at("focus").size(), 9U);
    // One name for each goal, in words of the help.
    EXPECT_EQ(line.at("goals").at(1).at("name"), "cells seen");
  }
}

TEST_F(Align, a_number_of_updates_ends_a_rig_that_is_not_good_enough) {
  const Outcome outcome = symrig({"align", "--rig", kBad, "--updates", "3", "--json", "-"});
  ASSERT_EQ(outcome.code, kFault) << outcome.err;
  EXPECT_NE(outcome.err.find("the rig is not good enough for a capture: cells seen, pixels a cell"),
            std::string::npos)
      << outcome.err;
  const auto lines = lines_of(outcome.out);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[2].at("update"), 3);
  EXPECT_EQ(lines[2].at("good"), false);
  EXPECT_LT(lines[2].at("cells_seen").get<double>(), 1);
  EXPECT_NEAR(lines[2].at("shift").at(0).get<double>(), 5, 0.1);
  // 1.67 pixels a cell: 2.2 / 1.67 times as large would do.
  EXPECT_NEAR(lines[2].at("cell_factor").get<double>(), 2.2 * 24 / 40, 0.05);
  EXPECT_TRUE(files().empty());
}

TEST_F(Align, a_camera_that_looks_elsewhere_is_shown) {
  const Outcome outcome =
      symrig({"align", "--rig", "sim:plane?size=24x24&camera=96x96&shift=60,0", "--updates", "1"});
  ASSERT_EQ(outcome.code, kFault) << outcome.err;
  EXPECT_NE(outcome.out.find("stripes no (!); not good enough yet"), std::string::npos) << outcome.out;
}

TEST_F(Align, control_c_leaves_no_file) {
  Running align(path(""), {"align", "--rig", kBad, "--json", "a.json"});
  ASSERT_TRUE(align.works(SIGINT, 0.3));
  align.signal(SIGINT);
  const Outcome outcome = align.wait();
  EXPECT_EQ(outcome.code, kFault);
  EXPECT_NE(outcome.err.find("stopped before the rig was good enough"), std::string::npos) << outcome.err;
  EXPECT_FALSE(files().contains("a.json"));
}

TEST_F(Align, what_does_not_fit_is_refused) {
  expect_refusal({"align"}, kUsage, {"--rig"});
  expect_refusal({"align", "--rig", kGood, "--updates", "-1"}, kUsage, {"--updates", "-1"});
  expect_refusal({"align", "--rig", "sim:plane?size=8x24"}, kFault, {"8x24", "12 rows"});
  expect_refusal({"align", "--rig", "none.toml"}, kBadInput, {"none.toml"});
}

}  // namespace
}  // namespace symrig::test::align_test
