// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/image/file.hpp"
#include "symrig/projector/projector.hpp"
#include "symrig/tensor/file.hpp"

#include <cmath>
#include <string>

#include <fmt/format.h>

namespace symrig::test::calibrate_test {
namespace {

/// Photographs of a flat scene that the camera sees pixel by pixel as the projector lights it.
class Photographs : public CommandTest {
 protected:
  static constexpr Grid kGrid{24, 40};
  static constexpr float kBlack = 0.05F, kDirect = 0.6F, kGlobal = 0.1F;

  void SetUp() override { write_photographs(kGrid); }
  void write_photographs(Grid grid) const {
    std::filesystem::create_directory(path("photographs"));
    const std::vector<Pattern> patterns = gray_code_patterns(grid);
    for (std::size_t k = 0; k < patterns.size(); ++k) write_photograph(k, patterns[k]);
  }
  static std::string name(std::size_t k) { return fmt::format("photographs/{:02}.png", k); }

  void write_photograph(std::size_t k, const Pattern& pattern) const {
    float mean = 0;
    for (const float v : pattern.values()) mean += v / static_cast<float>(pattern.grid().size());
    Image<float> seen(pattern.grid());
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

// Photographs of the column stripes, then white and black: a map without rows, in every file that the command
// writes.
TEST_F(Photographs, calibrate_of_columns_alone_writes_a_map_without_rows) {
  for (std::size_t k = 12; k < 22; ++k) std::filesystem::remove(path(name(k)));  // 5 pairs of rows
  const Outcome outcome =
      symrig({"calibrate", "--from", "photographs", "--projector", "24x40", "-o", "map.exr", "--uncertainty",
              "sigma.pfm", "--report", "map.html", "--json", "c.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(json("c.json").at("axes"), "columns");
  EXPECT_TRUE(json("c.json").at("rows").is_null());
  const Image<float> map = read_image(path("map.exr")).value();
  const Image<float> sigma = read_image(path("sigma.pfm")).value();
  for (int row = 2; row < kGrid.rows - 2; ++row)
    for (int col = 4; col < kGrid.cols - 4; ++col) {
      ASSERT_EQ(map.at(row, col, 2), 1) << row << "," << col;
      EXPECT_NEAR(map.at(row, col, 0), col, 0.5);
      EXPECT_EQ(map.at(row, col, 1), -1) << "no row";
      EXPECT_GE(sigma.at(row, col, 0), 0);
      EXPECT_EQ(sigma.at(row, col, 1), -1);
    }
  expect_refusal({"fit", "--from", "photographs", "--projector", "24x40", "-o", "fit.h5"}, kUsage,
                 {"one axis", "photograph the pairs of the other axis too"});
}

// A smooth model needs 100 blocks of 4 × 4 pixels; this map has 60. One of 375 is one plane, known to half a
// projector pixel: the bound of PixelMap.
TEST_F(Photographs, calibrate_fits_a_smooth_model_if_the_map_is_large_enough) {
  const Outcome small =
      symrig({"calibrate", "--from", "photographs", "--projector", "24x40", "--json", "small.json"});
  ASSERT_EQ(small.code, 0) << small.err;
  EXPECT_FALSE(json("small.json").contains("smooth"));
  EXPECT_EQ(small.out.find("smooth model"), std::string::npos);

  std::filesystem::remove_all(path("photographs"));
  write_photographs({60, 100});
  const Outcome outcome = symrig({"calibrate", "--from", "photographs", "--projector", "60x100", "--report",
                                  "map.html", "--json", "c.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const nlohmann::json smooth = json("c.json").at("smooth");
  EXPECT_EQ(smooth.at("pieces"), 1);
  EXPECT_LT(smooth.at("rms_held_out").get<double>(), 0.5);
  EXPECT_GT(smooth.at("share_planar").get<double>(), 0.2);
  EXPECT_EQ(smooth.at("share_far"), 0);
  EXPECT_GT(smooth.at("share_described").get<double>(), 0.95);
  EXPECT_LT(smooth.at("share_marked").get<double>(), 0.05);
  EXPECT_NE(outcome.out.find("smooth model of 1 piece:"), std::string::npos) << outcome.out;
  EXPECT_NE(read_text(path("map.html")).find("Smooth model"), std::string::npos);
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

TEST_F(Photographs, the_map_has_a_page_that_loads_nothing) {
  ASSERT_EQ(
      symrig({"calibrate", "--from", "photographs", "--projector", "24x40", "--report", "map.html"}).code, 0);
  const std::string page = read_text(path("map.html"));
  EXPECT_NE(page.find("Decoded, of the lit ones"), std::string::npos);
  EXPECT_NE(page.find("data:image/png;base64,"), std::string::npos);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
  EXPECT_EQ(page.find("<script"), std::string::npos);
}

// The same sequence as raw dumps: 16-bit words, 4 bytes of padding a row, and a capture.toml.
TEST_F(Photographs, raw_dumps_are_calibrated_by_their_capture_file) {
  std::filesystem::create_directory(path("raw"));
  const std::vector<Pattern> patterns = gray_code_patterns(kGrid);
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    std::string bytes;
    for (int r = 0; r < kGrid.rows; ++r) {
      for (int c = 0; c < kGrid.cols; ++c) {
        const auto code =
            static_cast<unsigned>(std::lround(65535 * (kBlack + kDirect * patterns[k].at(r, c))));
        bytes += static_cast<char>(code & 0xFFU);
        bytes += static_cast<char>(code >> 8U);
      }
      bytes += "pad!";
    }
    write_text(path(fmt::format("raw/{:02}.raw", k)), bytes);
  }
  const std::string layout = "[raw]\nformat = \"Y16\"\nsize = \"40x24\"\n";
  write_text(path("raw/capture.toml"), "symrig = 1\nprojector = \"24x40\"\n" + layout + "stride = 84\n");
  ASSERT_EQ(symrig({"calibrate", "--from", "raw", "--json", "c.json"}).code, 0);
  EXPECT_GT(json("c.json").at("decoded_share").get<double>(), 0.95);
  write_text(path("raw/capture.toml"), "symrig = 1\nprojector = \"24x40\"\n" + layout);
  expect_refusal({"calibrate", "--from", "raw"}, kBadInput, {"00.raw: has 2016 bytes", "1920"});
  write_text(path("raw/capture.toml"), "symrig = 1\nprojektor = \"24x40\"\n");
  expect_refusal({"calibrate", "--from", "raw"}, kBadInput, {"capture.toml:2", "projektor"});
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
  for (const char* size : {"100000x100000", "99999999999x768"})
    expect_refusal({"calibrate", "--from", "photographs", "--projector", size}, kUsage, {size, "too large"});
  expect_refusal({"calibrate", "--from", "photographs", "--projector", "24x40"}, kBadInput, {"photographs"});
}

TEST_F(Photographs, photographs_of_several_sizes_are_refused) {
  ASSERT_TRUE(write_image(path(name(3)), Image<float>({24, 41}, 1, 0.5F)).ok());
  expect_refusal({"calibrate", "--from", "photographs", "--projector", "24x40"}, kBadInput, {"24x41"});
}

TEST_F(Photographs, a_black_photograph_that_is_lit_is_named) {
  write_photograph(23, gray_code_patterns(kGrid)[4]);
  expect_refusal({"calibrate", "--from", "photographs", "--projector", "24x40"}, kBadInput,
                 {"23.png", "(black) is lit"});
}

TEST_F(Photographs, a_swapped_pair_is_named) {
  std::filesystem::rename(path(name(4)), path("x.png"));
  std::filesystem::rename(path(name(5)), path(name(4)));
  std::filesystem::rename(path("x.png"), path(name(5)));
  expect_refusal({"calibrate", "--from", "photographs", "--projector", "24x40"}, kBadInput,
                 {"04.png and 05.png", "swapped"});
}

TEST_F(Photographs, a_saturated_white_is_named) {
  ASSERT_TRUE(write_image(path(name(22)), Image<float>(kGrid, 1, 1)).ok());
  expect_refusal({"calibrate", "--from", "photographs", "--projector", "24x40"}, kBadInput,
                 {"22.png (white) is saturated"});
}

TEST_F(Photographs, no_black_photograph_is_named) {
  std::filesystem::remove(path(name(23)));
  expect_refusal({"calibrate", "--from", "photographs", "--projector", "24x40"}, kBadInput,
                 {"has 23 photographs", "22.png", "the black one is missing"});
}

TEST_F(Photographs, a_missing_photograph_that_is_not_black_is_not_taken_for_it) {
  std::filesystem::remove(path(name(22)));  // white: the last is dark
  expect_refusal({"calibrate", "--from", "photographs", "--projector", "24x40"}, kBadInput,
                 {"between 21.png and 23.png there is a gap"});
}

// 24 - 2 = 22 photographs stand for a projector of 32x32, were it not for the gap.
TEST_F(Photographs, a_missing_pair_is_named_where_the_number_alone_would_pass) {
  std::filesystem::remove(path(name(4)));
  std::filesystem::remove(path(name(5)));
  expect_refusal({"calibrate", "--from", "photographs"}, kBadInput,
                 {"has 22 photographs", "between 03.png and 06.png there is a gap"});
}

TEST_F(Photographs, a_camera_that_moved_is_named) {
  const std::vector<Pattern> patterns = gray_code_patterns(kGrid);
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    const int moved = k >= 8 ? 1 : 0;  // by a pixel, before the fifth pair
    Image<float> seen(kGrid);
    for (int r = 0; r < kGrid.rows; ++r)
      for (int c = 0; c < kGrid.cols; ++c) {
        const int x = std::min(c + moved, kGrid.cols - 1);
        const double albedo = 0.6 + 0.3 * std::sin(0.7 * x) * std::cos(0.5 * r);
        seen.at(r, c) = kBlack + static_cast<float>(albedo) * patterns[k].at(r, x);
      }
    ASSERT_TRUE(write_image(path(name(k)), seen).ok());
  }
  expect_refusal({"calibrate", "--from", "photographs", "--projector", "24x40"}, kBadInput,
                 {"has moved between 06.png and 08.png"});
}

TEST_F(Photographs, a_missing_photograph_is_named) {
  std::filesystem::remove(path(name(3)));
  expect_refusal({"fit", "--from", "photographs", "--projector", "24x40", "-o", "r.h5"}, kBadInput,
                 {"between 02.png and 04.png there is a gap"});
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

// symrig calibrate --rig RIG --levels: from even fields to the table that a rig file names.

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
}  // namespace symrig::test::calibrate_test
