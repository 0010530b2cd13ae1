// SPDX-License-Identifier: Apache-2.0
// The 42 real photographs, where they are (SYMRIG_PHOTOGRAPHS in the environment, or as configured): what the
// command says of them, and of folders in which something is wrong with them. They are linked, never copied;
// a picture that is altered is written to the test's own folder.
#include "command.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <cstdlib>
#include <functional>

#include <fmt/format.h>

namespace symrig::test::real_photographs_test {
namespace {

class RealFolder : public CommandTest {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("SYMRIG_PHOTOGRAPHS");  // NOLINT(concurrency-mt-unsafe): no threads here
    const std::filesystem::path from = folder ? folder : SYMRIG_PHOTOGRAPHS;
    if (!std::filesystem::is_directory(from))
      GTEST_SKIP() << "no photographs in " << from << "; set SYMRIG_PHOTOGRAPHS to their folder";
    std::filesystem::create_directory(path("photographs"));
    for (int k = 0; k < kAll; ++k) {
      sources_.push_back(std::filesystem::absolute(from / name(k)));
      link(k, k);
    }
  }

  static constexpr int kAll = 42, kWhite = 40, kBlack = 41;

  static std::string name(int k) { return fmt::format("graycode_{:02}.png", k); }
  std::filesystem::path at(int k) const { return path("photographs") / name(k); }
  /// Photograph k becomes a link to the real one of another number.
  void link(int k, int source) const {
    std::filesystem::remove(at(k));
    std::filesystem::create_symlink(sources_[source], at(k));
  }
  /// Photograph k becomes a changed copy, of the same number.
  void alter(int k, const std::function<float(const Image<float>&, int row, int col)>& value) const {
    const auto image = read_image(at(k));
    ASSERT_TRUE(image.ok()) << image.error().line();
    Image<float> changed(image->grid());
    for (int r = 0; r < changed.grid().rows; ++r)
      for (int c = 0; c < changed.grid().cols; ++c) changed.at(r, c) = value(*image, r, c);
    std::filesystem::remove(at(k));
    ASSERT_TRUE(write_image(path("photographs") / fmt::format("graycode_{:02}.pfm", k), changed).ok());
  }
  void is_refused(const std::vector<std::string>& words) const {
    expect_refusal({"calibrate", "--from", "photographs"}, kBadInput, words);
  }

 private:
  std::vector<std::filesystem::path> sources_;
};

// The bar of every stripe width from 8 px on; the pair is the one that fit chooses.
TEST_F(RealFolder, predicts_a_pair_that_the_fit_has_not_seen) {
  const Outcome outcome = symrig({"fit", "--from", "photographs", "-o", "real.h5", "--json", "f.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto figures = json("f.json");
  ASSERT_EQ(figures.at("held_out").size(), 2U);
  for (const auto& held_out : figures.at("held_out")) EXPECT_LE(held_out.at("relative").get<double>(), 0.06);
  const Outcome report = symrig({"report", "real.h5", "-o", "real.html"});
  EXPECT_EQ(report.code, 0) << report.err;
}

TEST_F(RealFolder, a_missing_photograph_is_named) {
  std::filesystem::remove(at(7));
  is_refused({"has 41 photographs", "between graycode_06.png and graycode_08.png there is a gap"});
}

TEST_F(RealFolder, a_missing_pair_is_named) {
  std::filesystem::remove(at(22));
  std::filesystem::remove(at(23));
  is_refused({"has 40 photographs", "between graycode_21.png and graycode_24.png there is a gap"});
}

TEST_F(RealFolder, a_missing_black_photograph_is_named) {
  std::filesystem::remove(at(kBlack));
  is_refused({"graycode_40.png, is the white one", "the black one is missing"});
}

TEST_F(RealFolder, a_black_photograph_that_is_lit_is_named) {
  link(kBlack, 30);
  is_refused({"graycode_41.png (black) is lit"});
}

TEST_F(RealFolder, a_saturated_white_photograph_is_named) {
  alter(kWhite, [](const Image<float>& white, int r, int c) { return std::min(1.0F, 2 * white.at(r, c)); });
  is_refused({"graycode_40.pfm (white) is saturated"});
}

TEST_F(RealFolder, a_camera_that_moved_by_a_pixel_is_named_with_the_place) {
  for (int k = 0; k < 6; ++k)
    alter(k, [](const Image<float>& image, int r, int c) { return image.at(r, std::max(c - 1, 0)); });
  is_refused({"has moved between graycode_04.pfm and graycode_06.png"});
}

TEST_F(RealFolder, a_photograph_of_another_pattern_is_named) {
  link(13, 15);
  is_refused({"graycode_12.png and graycode_13.png (columns, 16 px) do not add up"});
}

class RealSwappedPair : public RealFolder, public testing::WithParamInterface<int> {};

TEST_P(RealSwappedPair, is_named) {
  const int first = 2 * GetParam();
  link(first, first + 1);
  link(first + 1, first);
  is_refused({name(first) + " and " + name(first + 1), "swapped"});
}
// Ten pairs of columns, ten of rows; the coarsest of each shows in the map's orientation only.
INSTANTIATE_TEST_SUITE_P(Pairs, RealSwappedPair, testing::Values(0, 1, 4, 7, 9, 10, 11, 14, 17, 19));

}  // namespace
}  // namespace symrig::test::real_photographs_test
