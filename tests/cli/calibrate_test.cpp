// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/image/file.hpp"
#include "symrig/tensor/file.hpp"

#include <fmt/format.h>

namespace symrig::test {
namespace {

/// Photographs of a flat scene that the camera sees pixel by pixel as the projector lights it.
class Photographs : public CommandTest {
 protected:
  static constexpr Grid kGrid{24, 40};
  static constexpr float kBlack = 0.05F, kDirect = 0.6F, kGlobal = 0.1F;

  void SetUp() override {
    std::filesystem::create_directory(path("photographs"));
    const std::vector<Pattern> patterns = gray_code_patterns(kGrid);
    for (std::size_t k = 0; k < patterns.size(); ++k) write_photograph(k, patterns[k]);
  }
  static std::string name(std::size_t k) { return fmt::format("photographs/{:02}.png", k); }

  void write_photograph(std::size_t k, const Pattern& pattern) const {
    float mean = 0;
    for (const float v : pattern.values()) mean += v / static_cast<float>(kGrid.size());
    Image<float> seen(kGrid);
    for (std::size_t i = 0; i < seen.values().size(); ++i)
      seen.values()[i] = kBlack + kDirect * pattern.values()[i] + kGlobal * mean;
    ASSERT_TRUE(write_image(path(name(k)), seen).ok());
  }
};

TEST_F(Photographs, calibrate_finds_the_map) {
  const Outcome outcome = symrig(
      {"calibrate", "--from", "photographs", "--projector", "24x40", "-o", "map.exr", "--json", "c.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const nlohmann::json j = json("c.json");
  EXPECT_EQ(j.at("photographs"), 2 * (6 + 5) + 2);  // 40 columns: 6 bits; 24 rows: 5 bits
  EXPECT_EQ(j.at("projector_grid"), nlohmann::json::array({24, 40}));
  EXPECT_GT(j.at("decoded_share").get<double>(), 0.95);
  // Black and white are constants on a flat scene; 16-bit PNG rounds by 1/131070.
  EXPECT_NEAR(j.at("mean_black").get<double>(), kBlack, 1e-5);
  EXPECT_NEAR(j.at("mean_white").get<double>(), kBlack + kDirect + kGlobal, 1e-5);
  const Image<float> map = read_image(path("map.exr")).value();
  ASSERT_EQ(map.grid(), kGrid);
  for (int row = 2; row < kGrid.rows - 2; ++row)
    for (int col = 2; col < kGrid.cols - 2; ++col) {
      EXPECT_NEAR(map.at(row, col, 0), col, 0.5);  // half a projector pixel: PixelMap's bound
      EXPECT_NEAR(map.at(row, col, 1), row, 0.5);
    }
}

// The scene is exactly what the fit assumes, so that a photograph it has not seen is predicted to the
// rounding of the map: within half a pixel of each of the few stripe edges, and exactly elsewhere.
TEST_F(Photographs, fit_makes_a_scene_like_any_other) {
  const Outcome outcome =
      symrig({"fit", "--from", "photographs", "--projector", "24x40", "-o", "real.h5", "--json", "f.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const nlohmann::json j = json("f.json");
  EXPECT_EQ(j.at("algorithm"), "first-bounce");
  ASSERT_EQ(j.at("held_out").size(), 2U);  // a pattern and its complement
  for (const auto& held_out : j.at("held_out")) EXPECT_LT(held_out.at("relative").get<double>(), 0.08);
  ASSERT_EQ(symrig({"evaluate", "real.h5", "--json", "e.json"}).code, 0);
  EXPECT_EQ(json("e.json").at("held_out"), j.at("held_out"));
  EXPECT_EQ(symrig({"relight", "real.h5", "--light", "letters", "-o", "relit.exr"}).code, 0);
  EXPECT_EQ(symrig({"dual", "real.h5", "--light", "white", "-o", "dual.exr"}).code, 0);
  EXPECT_EQ(symrig({"inspect", "real.h5"}).code, 0);
  ASSERT_EQ(symrig({"report", "real.h5", "-o", "real.html"}).code, 0);
  EXPECT_NE(read_text(path("real.html")).find("Held-out photographs"), std::string::npos);
}

TEST_F(Photographs, nothing_is_held_out_when_asked_so) {
  ASSERT_EQ(
      symrig({"fit", "--from", "photographs", "--projector", "24x40", "-o", "real.h5", "--hold-out", "0"})
          .code,
      0);
  EXPECT_TRUE(load_scene(path("real.h5")).value().held_out.empty());
  expect_refusal({"evaluate", "real.h5"}, kUsage, {"held-out"});
}

TEST_F(Photographs, bad_folders_are_refused) {
  expect_refusal({"calibrate", "--from", "missing"}, kBadInput, {"missing"});
  expect_refusal({"fit", "--from", "missing", "-o", "real.h5"}, kBadInput, {"missing"});
  std::filesystem::create_directory(path("empty"));
  expect_refusal({"calibrate", "--from", "empty"}, kBadInput, {"empty"});
  std::filesystem::remove(path(name(3)));
  expect_refusal({"calibrate", "--from", "photographs", "--projector", "24x40"}, kBadInput, {"photographs"});
}

TEST_F(Photographs, photographs_of_several_sizes_are_refused) {
  ASSERT_TRUE(write_image(path(name(3)), Image<float>({24, 41}, 1, 0.5F)).ok());
  expect_refusal({"calibrate", "--from", "photographs", "--projector", "24x40"}, kBadInput, {"24x41"});
}

TEST_F(Photographs, a_damaged_photograph_is_refused) {
  const std::string whole = read_text(path(name(3)));
  write_text(path(name(3)), whole.substr(0, whole.size() / 2));
  expect_refusal({"fit", "--from", "photographs", "--projector", "24x40", "-o", "real.h5"}, kBadInput,
                 {"03.png"});
}

TEST_F(Photographs, wrong_settings_are_usage_errors) {
  expect_refusal({"calibrate", "--from", "photographs", "--rig", kSmall}, kUsage, {"--from", "--rig"});
  expect_refusal({"calibrate", "--from", "photographs", "--projector", "24by40"}, kUsage, {"24by40"});
  expect_refusal({"calibrate", "--from", "photographs", "-o", "map.png"}, kUsage, {"map.png"});
  expect_refusal({"fit", "--from", "photographs", "--projector", "24x40", "-o", "r.h5", "--hold-out", "12"},
                 kUsage, {"12", "11"});
  expect_refusal({"fit", "--from", "photographs", "--projector", "24x40", "-o", "missing/r.h5"}, kBadInput,
                 {"missing/r.h5"});
}

// The virtual rig's camera sees pixel by pixel what the projector shows: the map is the identity.
TEST_F(Photographs, calibrate_measures_a_rig) {
  const Outcome outcome =
      symrig({"calibrate", "--rig", "sim:plane?size=24x40&noise=off", "--json", "c.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const nlohmann::json j = json("c.json");
  EXPECT_GT(j.at("decoded_share").get<double>(), 0.9);
  EXPECT_NEAR(j.at("rig").at("offset").at(0).get<double>(), 0, 0.5);
  EXPECT_NEAR(j.at("rig").at("offset").at(1).get<double>(), 0, 0.5);
  EXPECT_EQ(j.at("rig").at("invalid_share"), 0.0);
  EXPECT_GT(j.at("rig").at("rig_seconds").get<double>(), 0);
}

// Real photographs, where they are. The bar is the project's own: 8 % of mean white.
TEST_F(Photographs, real_ones_predict_a_pair_they_have_not_seen) {
  if (!std::filesystem::is_directory(SYMRIG_PHOTOGRAPHS))
    GTEST_SKIP() << "no folder of real photographs at " << SYMRIG_PHOTOGRAPHS;
  const Outcome outcome = symrig({"fit", "--from", SYMRIG_PHOTOGRAPHS, "-o", "real.h5", "--json", "f.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto figures = json("f.json");
  ASSERT_EQ(figures.at("held_out").size(), 2U);
  for (const auto& held_out : figures.at("held_out")) EXPECT_LE(held_out.at("relative").get<double>(), 0.08);
  const Outcome report = symrig({"report", "real.h5", "-o", "real.html"});
  EXPECT_EQ(report.code, 0) << report.err;
}

}  // namespace
}  // namespace symrig::test
