// SPDX-License-Identifier: Apache-2.0
// symrig calibrate --rig RIG --levels: from even fields to the table that a rig file names.
#include "command.hpp"
#include "symrig/hdr/projector_response.hpp"
#include "symrig/projector/placement.hpp"

#include <cmath>
#include <string>

namespace symrig::test::levels_test {
namespace {

using Levels = CommandTest;

// The sensor is filled to 80 % of 20,000 e⁻: one pixel is known to 0.8 %, the mean of 576 to 0.033 %, each
// field is divided by white: 5 σ √2 are 0.24 %. Straight lines between levels 8 apart miss the curve by 0.033
// %.
TEST_F(Levels, a_gamma_is_measured_and_undone) {
  const Outcome outcome = symrig({"calibrate", "--rig", "sim:plane?size=24x24&gamma=2.2", "--levels",
                                  "levels.toml", "--json", "levels.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::string before = "gamma of ";
  const std::size_t gamma = outcome.out.find(before);
  ASSERT_NE(gamma, std::string::npos) << outcome.out;
  // ln(light) / ln(level / 255) where half of the light is: an error of 0.0028 counts twice, over 0.315.
  EXPECT_NEAR(std::stod(outcome.out.substr(gamma + before.size())), 2.2, 2 * 0.0028 / 0.315);
  const auto light = load_projector_light(path("levels.toml"));
  ASSERT_TRUE(light.ok()) << light.error().line();
  for (std::size_t level = 0; level < light->size(); ++level)
    EXPECT_NEAR((*light)[level], std::pow(static_cast<double>(level) / 255, 2.2), 0.0028) << level;
  const auto table = CodeTable::from_light(*light);
  ASSERT_TRUE(table.ok()) << table.error().line();
  for (const float share : {0.1F, 0.25F, 0.5F, 0.75F})
    EXPECT_NEAR(std::pow(table->code(share) / 255.0, 2.2), share, 0.0028 + 0.0044) << "half the largest step";
  const nlohmann::json j = json("levels.json");
  EXPECT_EQ(j.at("light").size(), 256U);
  EXPECT_NEAR(j.at("half_level").get<double>(), 255 * std::pow(0.5, 1 / 2.2), 1);
}

TEST_F(Levels, what_does_not_go_together_is_refused) {
  expect_refusal({"calibrate", "--sensor", "frames", "--levels", "l.toml"}, 2, {"--levels"});
  expect_refusal({"calibrate", "--rig", "sim:plane?size=16x16", "--levels", "l.toml", "-o", "m.exr"}, 2,
                 {"--levels"});
}

}  // namespace
}  // namespace symrig::test::levels_test
