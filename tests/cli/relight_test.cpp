// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/relight.hpp"

#include "command.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/image/file.hpp"
#include "symrig/report/text.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_operator.hpp"

#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>

namespace symrig::test::relight_test {
namespace {

class Relight : public CommandTest {
 protected:
  void SetUp() override { capture_small(fmt::format("{}&channels=3", kSmall)); }

  TransportTensor tensor() const { return std::move(load_scene(path("scene.h5")).value().tensor); }
  void write_light(const std::string& name, const Image<float>& light) const {
    ASSERT_TRUE(write_image(path(name), light).ok());
  }
  /// A PFM written by hand, so that it may hold what write_image refuses.
  void write_raw_pfm(const std::string& name, Grid grid, const std::vector<float>& values) const {
    std::string file = "Pf\n" + std::to_string(grid.cols) + " " + std::to_string(grid.rows) + "\n-1.0\n";
    const std::size_t head = file.size();
    file.resize(head + values.size() * sizeof(float));
    std::memcpy(file.data() + head, values.data(), values.size() * sizeof(float));
    write_text(path(name), file);
  }
  static constexpr Grid kGrid{12, 17};
};

Image<float> ramp(Grid grid, int channels) {
  Image<float> light(grid, channels);
  for (std::size_t i = 0; i < light.values().size(); ++i) light.values()[i] = static_cast<float>(i % 61) / 61;
  return light;
}

// EXR and PFM hold 32-bit floats: what the command writes is what the library computes, bit for bit.
TEST_F(Relight, an_exr_states_what_it_is) {
  ASSERT_EQ(symrig({"relight", "scene.h5", "--light", "white", "-o", "out.exr"}).code, 0);
  ASSERT_EQ(symrig({"dual", "scene.h5", "--light", "letters", "-o", "dual.exr"}).code, 0);
  const PictureFacts relit = read_picture_facts(path("out.exr")).value();
  const PictureFacts dual = read_picture_facts(path("dual.exr")).value();
  EXPECT_EQ(relit.units, "radiance per unit of projector light");
  EXPECT_EQ(relit.view, "camera");
  EXPECT_EQ(relit.light, "white");
  EXPECT_EQ(dual.view, "projector");
  EXPECT_EQ(dual.light, "letters");
  EXPECT_EQ(relit.scene, file_hash(path("scene.h5")).value());
  EXPECT_EQ(dual.scene, relit.scene);
  EXPECT_EQ(relit.scene.size(), 64U);
  // 99.5 % of the values times the exposure are below white.
  const Image<float> picture = read_image(path("out.exr")).value();
  const auto bright = std::count_if(picture.values().begin(), picture.values().end(), [&](float v) {
    return static_cast<double>(v) * *relit.exposure > 1 + 1e-6;
  });
  EXPECT_LE(bright, std::ssize(picture.values()) / 200 + 1);
}

TEST_F(Relight, an_exr_holds_exactly_what_the_library_computes) {
  write_light("light.exr", ramp(kGrid, 1));
  for (const char* output : {"out.exr", "out.pfm"}) {
    const Outcome outcome = symrig({"relight", "scene.h5", "--light", "light.exr", "-o", output});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto written = read_image(path(output));
    ASSERT_TRUE(written.ok());
    EXPECT_EQ(*written, tensor().apply(ramp(kGrid, 1)).value()) << output;
  }
}

// A raw mosaic in colour: each pixel keeps its own sample in the colour that it sees, and the light of two
// patterns that add up to flood light adds up to the flood-lit scene in every colour.
TEST_F(Relight, a_mosaic_becomes_colour_with_every_sample_kept) {
  capture_small();  // one channel: the mosaic
  Image<float> left(kGrid), right(kGrid);
  for (int row = 0; row < kGrid.rows; ++row)
    for (int col = 0; col < kGrid.cols; ++col) (col < 8 ? left : right).at(row, col) = 1;
  write_light("left.exr", left);
  write_light("right.exr", right);
  const auto relit = [&](const std::string& light) {
    const Outcome outcome =
        symrig({"relight", "scene.h5", "--light", light, "--mosaic", "GRBG", "-o", "out.exr"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return read_image(path("out.exr")).value();
  };
  const Image<float> a = relit("left.exr"), b = relit("right.exr"), flood = relit("white");
  ASSERT_EQ(a.channels(), 3);
  const Image<float> mosaic = tensor().apply(left).value();
  const int colours[2][2] = {{1, 0}, {2, 1}};
  for (int row = 0; row < kGrid.rows; ++row)
    for (int col = 0; col < kGrid.cols; ++col) {
      EXPECT_NEAR(a.at(row, col, colours[row % 2][col % 2]), mosaic.at(row, col), 1e-6);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(a.at(row, col, c) + b.at(row, col, c), flood.at(row, col, c),
                    1e-5 * flood.at(row, col, c) + 1e-7);
    }
}

TEST_F(Relight, a_mosaic_that_is_none_is_refused) {
  expect_refusal({"relight", "scene.h5", "--light", "white", "--mosaic", "RGGB", "-o", "out.exr"}, kUsage,
                 {"--mosaic", "already has colour channels"});
  expect_refusal({"relight", "scene.h5", "--light", "white", "--mosaic", "RGBG", "-o", "out.exr"}, kUsage,
                 {"RGBG"});
}

TEST_F(Relight, dual_is_the_transpose) {
  write_light("light.exr", ramp(kGrid, 1));
  ASSERT_EQ(symrig({"dual", "scene.h5", "--light", "light.exr", "-o", "dual.exr"}).code, 0);
  EXPECT_EQ(read_image(path("dual.exr")).value(), tensor().apply_transposed(ramp(kGrid, 1)).value());
}

TEST_F(Relight, built_in_lights_need_no_file) {
  const auto relit = [&](const char* light) {
    EXPECT_EQ(symrig({"relight", "scene.h5", "--light", light, "-o", "out.exr"}).code, 0) << light;
    return read_image(path("out.exr")).value();
  };
  EXPECT_EQ(relit("white"), tensor().apply(Image<float>(kGrid, 1, 1.0F)).value());
  EXPECT_EQ(relit("bar"), tensor().apply(bar_pattern(kGrid)).value());
  EXPECT_EQ(relit("letters"), tensor().apply(letters_pattern(kGrid)).value());
  EXPECT_EQ(relit("natural").grid(), kGrid);
}

// Luminance is linear, so relighting by it differs from the weighed sum of three pictures by rounding only: 8
// float steps cover the three products and two sums on either side.
TEST_F(Relight, colour_light_becomes_its_luminance) {
  const Image<float> colour = ramp(kGrid, 3);
  write_light("colour.exr", colour);
  const Outcome outcome = symrig({"relight", "scene.h5", "--light", "colour.exr", "-o", "out.exr"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(
      outcome.err,
      "symrig relight: warning: colour.exr is in colour; its luminance is the light, because patterns are "
      "white\n");
  Image<float> grey(kGrid);
  for (std::size_t i = 0; i < grey.values().size(); ++i)
    grey.values()[i] =
        0.2126F * colour.plane(0)[i] + 0.7152F * colour.plane(1)[i] + 0.0722F * colour.plane(2)[i];
  const Image<float> expected = tensor().apply(grey).value();
  const Image<float> relit = read_image(path("out.exr")).value();
  ASSERT_EQ(relit.grid(), expected.grid());
  float brightest = 0;
  for (const float v : expected.values()) brightest = std::max(brightest, std::abs(v));
  for (std::size_t i = 0; i < relit.values().size(); ++i)
    EXPECT_NEAR(relit.values()[i], expected.values()[i], 8 * 0x1p-23F * brightest);
}

TEST_F(Relight, a_png_is_for_looking_and_exposure_is_a_factor) {
  const Outcome outcome =
      symrig({"relight", "scene.h5", "--light", "white", "-o", "out.png", "--exposure", "0.5"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Image<float> shown = read_image(path("out.png")).value();
  const Image<std::uint8_t> expected = to_display(tensor().apply(Image<float>(kGrid, 1, 1.0F)).value(), 0.5);
  for (std::size_t i = 0; i < shown.values().size(); ++i)
    EXPECT_EQ(std::lround(255 * shown.values()[i]), expected.values()[i]);
}

TEST_F(Relight, a_light_of_another_size_is_refused_with_both_sizes) {
  write_light("wide.exr", Image<float>({12, 18}, 1, 1.0F));
  for (const char* command : {"relight", "dual"})
    expect_refusal({command, "scene.h5", "--light", "wide.exr", "-o", "out.exr"}, kBadInput,
                   {"wide.exr", "12x18", "12x17"});
}

TEST_F(Relight, nan_and_infinity_in_a_light_are_refused) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    std::vector<float> values(kGrid.size(), 1.0F);
    values[100] = bad;
    write_raw_pfm("bad.pfm", kGrid, values);
    for (const char* command : {"relight", "dual"})
      expect_refusal({command, "scene.h5", "--light", "bad.pfm", "-o", "out.exr"}, kBadInput, {"bad.pfm"});
  }
}

TEST_F(Relight, files_that_are_not_there_or_not_pictures_are_refused) {
  write_text(path("text.png"), "hello");
  expect_refusal({"relight", "scene.h5", "--light", "none.exr", "-o", "out.exr"}, kBadInput, {"none.exr"});
  expect_refusal({"relight", "scene.h5", "--light", "text.png", "-o", "out.exr"}, kBadInput, {"text.png"});
  expect_refusal({"relight", "none.h5", "--light", "white", "-o", "out.exr"}, kBadInput, {"none.h5"});
  expect_refusal({"relight", "text.png", "--light", "white", "-o", "out.exr"}, kBadInput, {"text.png"});
}

TEST_F(Relight, outputs_that_cannot_be_are_refused) {
  expect_refusal({"relight", "scene.h5", "--light", "white", "-o", "out.jpg"}, kUsage, {"out.jpg", ".exr"});
  expect_refusal({"relight", "scene.h5", "--light", "white", "-o", "missing/out.exr"}, kBadInput,
                 {"missing/out.exr"});
  expect_refusal({"relight", "scene.h5", "--light", "white", "-o", "/proc/out.exr"}, kBadInput,
                 {"/proc/out.exr"});
  expect_refusal({"relight", "scene.h5", "--light", "white", "-o", "out.exr", "--exposure", "2"}, kUsage,
                 {"--exposure"});
  expect_refusal({"relight", "scene.h5", "--light", "white", "-o", "out.png", "--exposure", "0"}, kUsage,
                 {"--exposure"});
}

constexpr Grid kGrid{12, 18};
constexpr ViewLayout kViews{2, 2};

/// A small scene of 2x2 views.
class RelightViews : public CommandTest {
 protected:
  void SetUp() override { capture_small("sim:views2?size=" + to_string(kGrid) + "&noise=off"); }

  Outcome relight_with(std::vector<std::string> options) const {
    std::vector<std::string> arguments{"relight", "scene.h5", "--light", "light.pfm", "-o", "out.pfm"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return symrig(arguments);
  }
  void write_light(Grid grid) const {
    Image<float> light(grid);
    for (std::size_t i = 0; i < light.values().size(); ++i) light.values()[i] = static_cast<float>(i % 7) / 7;
    ASSERT_TRUE(write_image(path("light.pfm"), light).ok());
  }
  /// What the library makes of the same light. PFM holds 32-bit floats: it must agree bit for bit.
  Image<float> expected(const ViewRelight& what) const {
    const StoredScene scene = load_scene(path("scene.h5")).value();
    return relight(scene.tensor, read_image(path("light.pfm")).value(), what).value();
  }
};

TEST_F(RelightViews, one_projector_seen_from_another_view) {
  write_light(kViews.tile(kGrid, {0, 1}).grid);
  const Outcome outcome = relight_with({"--views", "2x2", "--from-view", "0,1", "--to-view", "1,0"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Image<float> picture = read_image(path("out.pfm")).value();
  EXPECT_EQ(picture.grid(), (Grid{6, 9}));
  EXPECT_EQ(picture, expected({kViews, View{0, 1}, View{1, 0}}));
}

TEST_F(RelightViews, all_projectors_seen_from_one_view) {
  write_light(kGrid);
  const Outcome outcome = relight_with({"--views", "2x2", "--to-view", "1,1"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(read_image(path("out.pfm")).value(), expected({kViews, {}, View{1, 1}}));
}

TEST_F(RelightViews, a_light_of_the_wrong_size_is_refused_with_both_sizes) {
  write_light(kGrid);
  const Outcome outcome = relight_with({"--views", "2x2", "--from-view", "0,1"});
  EXPECT_EQ(outcome.code, kBadInput);
  EXPECT_NE(outcome.err.find("12x18"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("6x9"), std::string::npos) << outcome.err;
}

TEST_F(RelightViews, views_that_are_not_there_or_not_written_so_are_usage_errors) {
  write_light(kViews.tile(kGrid, {0, 0}).grid);
  for (const std::vector<std::string>& options :
       std::vector<std::vector<std::string>>{{"--views", "2x2", "--from-view", "0,2"},
                                             {"--views", "2x2", "--to-view", "-1,0"},
                                             {"--views", "2x2", "--from-view", "0"},
                                             {"--views", "2x2", "--from-view", "0,0,0"},
                                             {"--views", "2x2", "--from-view", "a,0"},
                                             {"--views", "2", "--from-view", "0,0"},
                                             {"--views", "13x1", "--from-view", "0,0"},
                                             {"--views", "0x0"},
                                             {"--views", "1x1", "--from-view", "0,0"}}) {
    const Outcome outcome = relight_with(options);
    EXPECT_EQ(outcome.code, kUsage) << options[1];
    EXPECT_FALSE(outcome.err.empty());
  }
}

}  // namespace
}  // namespace symrig::test::relight_test
