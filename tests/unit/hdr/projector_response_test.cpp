// SPDX-License-Identifier: Apache-2.0
#include "scratch.hpp"
#include "simulated_sensor.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/projector/projector.hpp"

#include <cmath>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

namespace symrig::projector_response_test {
namespace {

std::vector<FieldLight> projector_levels(double gamma, double black, double sigma, int step) {
  test::Random random(2);
  std::vector<FieldLight> levels;
  for (int level = 0; level <= 255; level += step) {
    const double light = black + (1 - black) * std::pow(level / 255.0, gamma);
    levels.push_back({level, light + sigma * random.normal(), sigma * sigma});
  }
  return levels;
}

TEST(ProjectorResponse, IsMeasuredAndInverted) {
  const double sigma = 1e-4;
  const auto response = ProjectorResponse::fit(projector_levels(2.2, 0.002, sigma, 1));
  ASSERT_TRUE(response.ok()) << response.error().line();
  EXPECT_EQ(response->light(0), 0);  // black is taken off
  const auto table = CodeTable::from_light(response->curve().light);
  ASSERT_TRUE(table.ok()) << table.error().line();
  for (const float share : {0.0F, 0.1F, 0.25F, 0.5F, 0.75F, 1.0F}) {
    const double given = std::pow(table->code(share) / 255.0, 2.2);
    EXPECT_NEAR(given, share, response->resolution() + 10 * sigma) << share;
  }
  EXPECT_LT(response->resolution(), 0.0045);  // half of 2.2 / 255
}

// Straight lines between levels 15 apart miss a curve by at most h² / 8 · max|f''| = (15/255)² / 8 · 2.64.
TEST(ProjectorResponse, FewLevelsAreEnoughForASmoothOne) {
  const auto response = ProjectorResponse::fit(projector_levels(2.2, 0, 1e-5, 15));
  ASSERT_TRUE(response.ok()) << response.error().line();
  for (int level = 0; level <= 255; ++level)
    EXPECT_NEAR(response->light(level), std::pow(level / 255.0, 2.2), 0.00115 + 1e-4);
}

TEST(ProjectorResponse, NamesWhatIsWrong) {
  auto levels = projector_levels(2.2, 0.01, 1e-4, 15);
  levels[9].light = 0.02;
  const auto fallen = ProjectorResponse::fit(levels);
  ASSERT_FALSE(fallen.ok());
  EXPECT_EQ(fallen.error().code, ErrorCode::bad_value);
  EXPECT_NE(fallen.error().what.find("level 135"), std::string::npos) << fallen.error().what;
  for (FieldLight& level : levels) level.light = 0.5;
  EXPECT_EQ(ProjectorResponse::fit(levels).error().code, ErrorCode::bad_value);
  levels.resize(3);
  EXPECT_EQ(ProjectorResponse::fit(levels).error().code, ErrorCode::bad_argument);
}

// What is written is what a projector's code table takes, and turns shares of light into levels again.
TEST(ProjectorResponse, GoesThroughAFileToTheCodeTable) {
  const test::Scratch scratch;
  const auto response = ProjectorResponse::fit(projector_levels(2.2, 0.002, 1e-5, 15));
  ASSERT_TRUE(response.ok()) << response.error().line();
  ASSERT_TRUE(save_projector_response(scratch / "levels.toml", *response).ok());
  const auto light = load_projector_light(scratch / "levels.toml");
  ASSERT_TRUE(light.ok()) << light.error().line();
  const auto table = CodeTable::from_light(*light);
  const auto before = CodeTable::from_light(response->curve().light);
  ASSERT_TRUE(table.ok()) << table.error().line();
  ASSERT_TRUE(before.ok()) << before.error().line();
  for (const float share : {0.0F, 0.1F, 0.25F, 0.5F, 0.75F, 1.0F})
    EXPECT_EQ(table->code(share), before->code(share)) << share;
}

TEST(ProjectorResponse, ADamagedFileIsNamedWithItsLine) {
  const test::Scratch scratch;
  const auto refused = [&](const std::string& text, const std::string& says) {
    std::ofstream(scratch / "levels.toml") << text;
    const auto light = load_projector_light(scratch / "levels.toml");
    ASSERT_FALSE(light.ok()) << text;
    EXPECT_EQ(light.error().code, ErrorCode::bad_format);
    EXPECT_NE(light.error().what.find(says), std::string::npos) << light.error().line();
  };
  refused("light = 3\n", "there is no key light");
  refused("", "no table [levels]");
  refused("[levels]\nlight = [0, 0.5,\n 0.4]\n", "levels.toml:3: levels.light falls");
  refused("[levels]\nlight = [0, 1]\n", "has 2 levels, not 256");
  refused("[levels\n", "levels.toml:1");
  EXPECT_EQ(load_projector_light(scratch / "none.toml").error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace symrig::projector_response_test
