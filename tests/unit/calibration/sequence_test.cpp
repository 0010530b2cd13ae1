// SPDX-License-Identifier: Apache-2.0
// Sequences without complements, and of one axis alone.
#include "scratch.hpp"
#include "symrig/calibration/first_bounce.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/image/file.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

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

namespace symrig::partial_sequence_test {
namespace {

using test::SyntheticScene;

/// Images and names of the photographs that `keep` wants.
struct Stack {
  std::vector<Image<float>> images;
  std::vector<std::string> names;
};
template <class Keep>
Stack kept(const CodePhotographs& all, Keep keep) {
  Stack stack;
  for (int i = 0; i < all.code.photographs(); ++i)
    if (i >= all.code.white() || keep(i))
      stack.images.push_back(all.image(i)), stack.names.push_back(all.names[i]);
  return stack;
}
Result<CodePhotographs> arranged(Grid projector, Stack stack) {
  return arrange_code_photographs(projector, std::move(stack.images), std::move(stack.names));
}

const CodePhotographs& all() {
  return test::default_photographs();
}
bool is_column(int photograph) {
  return photograph / 2 < all().code.column_bits();
}
Stack columns() {
  return kept(all(), is_column);
}
Stack patterns() {
  return kept(all(), [](int i) { return i % 2 == 0; });
}

PixelMap map_of(const Result<CodePhotographs>& photographs) {
  EXPECT_TRUE(photographs.ok());
  auto map = decode(*photographs);
  EXPECT_TRUE(map.ok()) << (map.ok() ? "" : map.error().line());
  return map.ok() ? std::move(*map) : PixelMap{};
}

/// rms error of the columns of the decoded pixels, and their share of the lit ones.
std::pair<double, double> columns_of(const PixelMap& map) {
  const SyntheticScene scene;
  double squares = 0, decoded = 0, lit = 0;
  for (int r = 0; r < scene.camera.rows; ++r)
    for (int c = 0; c < scene.camera.cols; ++c) {
      const double col = scene.col(r, c), row = SyntheticScene::row(r, c);
      if (SyntheticScene::shadow(r, c) || col < 2 || col > 97 || row < 2 || row > 77) continue;
      lit += 1;
      if (!map.mask.at(r, c)) continue;
      decoded += 1, squares += std::pow(static_cast<double>(map.col.at(r, c)) - col, 2);
    }
  return {std::sqrt(squares / decoded), decoded / lit};
}

TEST(PartialSequence, IsTakenForWhatItsNumberAllows) {
  const Grid projector = all().code.projector();  // 7 bits each
  const auto whole = arranged(projector, kept(all(), [](int) { return true; }));
  ASSERT_TRUE(whole.ok());
  EXPECT_EQ(whole->code.axes(), CodeAxes::both);
  EXPECT_FALSE(whole->complements_derived);
  // 16 photographs are seven pairs, or 14 patterns: the light decides.
  const auto of_columns = arranged(projector, columns()), of_patterns = arranged(projector, patterns());
  ASSERT_TRUE(of_columns.ok() && of_patterns.ok());
  EXPECT_EQ(of_columns->code.axes(), CodeAxes::columns);
  EXPECT_FALSE(of_columns->complements_derived);
  EXPECT_EQ(of_patterns->code.axes(), CodeAxes::both);
  EXPECT_TRUE(of_patterns->complements_derived);
  EXPECT_EQ(of_patterns->images.size(), all().images.size());
  const auto least = arranged(projector, kept(all(), [](int i) { return is_column(i) && i % 2 == 0; }));
  ASSERT_TRUE(least.ok());
  EXPECT_EQ(least->code.axes(), CodeAxes::columns);
  EXPECT_TRUE(least->complements_derived);
  const auto refused = arranged(projector, kept(all(), [](int i) { return i > 0; }));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::size_mismatch);
}

// The noise of a difference is √3 times as large, and its photographs' noise is found without any pair.
TEST(PartialSequence, WithoutComplementsIsDecoded) {
  const PixelMap map = map_of(arranged(all().code.projector(), patterns()));
  const auto [rms, decoded] = columns_of(map);
  EXPECT_LE(rms, 0.12);
  EXPECT_GE(decoded, 0.98);
  EXPECT_EQ(map.axes, CodeAxes::both);
  EXPECT_NEAR(map.noise, std::hypot(0.004, 0.00113), 0.2 * 0.004);
}

TEST(PartialSequence, OfColumnsHasNoRows) {
  const PixelMap map = map_of(arranged(all().code.projector(), columns()));
  const auto [rms, decoded] = columns_of(map);
  EXPECT_LE(rms, 0.10);
  EXPECT_GE(decoded, 0.99);
  EXPECT_EQ(map.axes, CodeAxes::columns);
  EXPECT_EQ(map.projector, all().code.projector());
  for (std::size_t i = 0; i < map.mask.values().size(); ++i) {
    if (!map.mask.values()[i]) continue;
    ASSERT_TRUE(std::isnan(map.row.values()[i]));
    ASSERT_TRUE(std::isinf(map.row_sigma.values()[i]));
    ASSERT_TRUE(std::isfinite(map.col.values()[i]));
    ASSERT_TRUE(std::isfinite(map.col_sigma.values()[i]));
  }
}

// The distance from the neighbours is along the one axis that there is.
TEST(PartialSequence, OfColumnsIsJudgedAlongThem) {
  const PixelMap both = map_of(all()), map = map_of(arranged(all().code.projector(), columns()));
  const MapQuality whole = judge_map(both), part = judge_map(map);
  EXPECT_NEAR(part.rms, whole.rms, 0.3 * whole.rms);
  EXPECT_GE(part.valid_share, 0.97 * whole.valid_share);
}

TEST(PartialSequence, OfColumnsIsRefusedWhereRowsAreNeeded) {
  const auto photographs = arranged(all().code.projector(), columns());
  const PixelMap map = map_of(photographs);
  const auto names_rows = [](const Error& error) {
    return error.code == ErrorCode::bad_value &&
           error.line().find("the map has no rows") != std::string::npos;
  };
  EXPECT_TRUE(names_rows(fit_first_bounce(*photographs).error()));
  EXPECT_TRUE(names_rows(fit_smooth_map(map).error()));
  EXPECT_TRUE(names_rows(Resampling::from_map(map).error()));
  EXPECT_EQ(decode(*photographs, {.held_out_pair = 1}).error().code, ErrorCode::bad_argument);
}

TEST(PartialSequence, OfColumnsComesBackFromItsFile) {
  const PixelMap map = map_of(arranged(all().code.projector(), columns()));
  const test::Scratch folder;
  for (const char* name : {"map.exr", "map.pfm"}) {
    ASSERT_TRUE(write_image(folder / name, map_picture(map)).ok());
    const auto read = read_pixel_map(folder / name, map.projector);
    ASSERT_TRUE(read.ok()) << read.error().line();
    EXPECT_EQ(read->axes, CodeAxes::columns);
    EXPECT_EQ(read->mask, map.mask);
    for (std::size_t i = 0; i < map.mask.values().size(); ++i) {
      if (map.mask.values()[i]) {
        ASSERT_TRUE(std::isnan(read->row.values()[i]));
        ASSERT_EQ(read->col.values()[i], map.col.values()[i]);
      }
    }
  }
  // One pixel with a row among pixels without is no map.
  Image<float> picture = map_picture(map);
  for (std::size_t i = 0; i < map.mask.values().size(); ++i)
    if (map.mask.values()[i]) {
      picture.plane(1)[i] = 3;
      break;
    }
  EXPECT_EQ(map_of_picture(picture, map.projector, "map.exr").error().code, ErrorCode::bad_value);
}

TEST(PartialSequence, OfRowsDecodes) {
  CodePhotographs rows{GrayCode(all().code.projector(), CodeAxes::rows), {}, {}};
  Stack stack = kept(all(), [](int i) { return !is_column(i); });
  rows.names = std::move(stack.names), rows.images = std::move(stack.images);
  const auto map = decode(rows);
  ASSERT_TRUE(map.ok()) << map.error().line();
  EXPECT_EQ(map->axes, CodeAxes::rows);
  const PixelMap both = map_of(all());
  double apart = 0, count = 0;
  for (std::size_t i = 0; i < both.mask.values().size(); ++i)
    if (both.mask.values()[i] && map->mask.values()[i])
      apart += std::abs(static_cast<double>(map->row.values()[i] - both.row.values()[i])), count += 1;
  EXPECT_LE(apart / count, 0.01);  // each axis is decoded by itself
}

}  // namespace
}  // namespace symrig::partial_sequence_test
