// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/pixel_map.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace symrig::wrong_sequence_test {
namespace {

/// The refusal's text; empty if there is none.
std::string refusal(const CodePhotographs& photographs) {
  const auto map = decode(photographs);
  if (map) return {};
  EXPECT_EQ(map.error().code, ErrorCode::bad_value);
  std::string line = map.error().line();
  EXPECT_EQ(line.find('\n'), std::string::npos);
  return line;
}

bool names(const std::string& line, const std::string& what) {
  return line.find(what) != std::string::npos;
}

class SwappedPair : public testing::TestWithParam<int> {};

TEST_P(SwappedPair, IsNamed) {
  auto photographs = test::default_photographs();
  const std::size_t first = 2 * static_cast<std::size_t>(GetParam());
  std::swap(photographs.images[first], photographs.images[first + 1]);
  const std::string line = refusal(photographs);
  EXPECT_TRUE(names(line, photographs.names[first] + " and ")) << line;
  EXPECT_TRUE(names(line, "swapped")) << line;
}
// Seven column bits, then seven row bits; all but the coarsest of each axis, and but the two coarsest of the
// rows: one of their stripes is wider than what the camera sees of the 80 rows.
INSTANTIATE_TEST_SUITE_P(Pairs, SwappedPair, testing::Values(2, 3, 4, 5, 6, 9, 10, 11, 12, 13));

TEST(WrongSequence, CoarsestPairSwappedRunsBackwardsAndIsNamed) {
  const int rows = 2 * test::default_photographs().code.column_bits();
  for (const int first : {0, rows}) {
    auto photographs = test::default_photographs();
    const std::size_t at = first;
    std::swap(photographs.images[at], photographs.images[at + 1]);
    const std::string line = refusal(photographs);
    EXPECT_TRUE(names(line, "backwards")) << line;
    EXPECT_TRUE(names(line, photographs.names[at] + " and " + photographs.names[at + 1])) << line;
    EXPECT_FALSE(names(line, photographs.names[rows - first] + " and ")) << line;
  }
}

TEST(WrongSequence, SaturatedWhiteIsNamed) {
  auto photographs = test::default_photographs();
  for (float& v : photographs.images[photographs.code.white()].values()) v = std::min(1.0F, 1.7F * v);
  const std::string line = refusal(photographs);
  EXPECT_TRUE(names(line, "(white) is saturated")) << line;
  EXPECT_TRUE(names(line, photographs.names[photographs.code.white()])) << line;
}

TEST(WrongSequence, BlackThatIsAPatternIsNamed) {
  auto photographs = test::default_photographs();
  photographs.images.back() = photographs.images[6];
  const std::string line = refusal(photographs);
  EXPECT_TRUE(names(line, "(black) is lit")) << line;
}

TEST(WrongSequence, APhotographOfAnotherPatternIsNamed) {
  auto photographs = test::default_photographs();
  photographs.images[7] = photographs.images[9];
  const std::string line = refusal(photographs);
  EXPECT_TRUE(names(line, photographs.names[6] + " and " + photographs.names[7])) << line;
  EXPECT_TRUE(names(line, "do not add up")) << line;
}

TEST(WrongSequence, ACameraThatMovedIsNamedWithThePlace) {
  auto photographs = test::default_photographs();
  const Grid grid = photographs.camera();
  for (std::size_t k = 8; k < photographs.images.size(); ++k) {
    const Image<float> still = photographs.images[k];
    for (int r = 0; r < grid.rows; ++r)
      for (int c = 1; c < grid.cols; ++c) photographs.images[k].at(r, c) = still.at(r, c - 1);
  }
  const std::string line = refusal(photographs);
  EXPECT_TRUE(names(line, "has moved between")) << line;
  EXPECT_TRUE(names(line, photographs.names[8] + ":")) << line;
}

TEST(WrongSequence, OneWithoutPairsIsNamed) {
  const CodePhotographs& all = test::default_photographs();
  const CodePhotographs none{GrayCode({1, 1}), {"white", "black"}, {all.white(), all.black()}};
  EXPECT_TRUE(names(refusal(none), "has no pairs"));
}

TEST(WrongSequence, ARightOneIsNotRefused) {
  EXPECT_EQ(refusal(test::default_photographs()), "");
  test::SyntheticScene noisy;
  noisy.noise = 0.03;
  EXPECT_EQ(refusal(test::photograph_sequence(noisy)), "");
}

}  // namespace
}  // namespace symrig::wrong_sequence_test
