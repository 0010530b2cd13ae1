// SPDX-License-Identifier: Apache-2.0
// Every fault at every place of a good sequence: it is refused, or does no harm, and no innocent photograph
// is named alone. And good sequences of many kinds, of which none is refused.
#include "calibration/sequence/sequence_check.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::sequence_faults_test {
namespace {

using test::SyntheticScene;

/// Photographs of the scene, without noise.
CodePhotographs clean(const SyntheticScene& scene) {
  const GrayCode code(scene.projector);
  CodePhotographs photographs{code, {}, {}};
  for (int i = 0; i < code.photographs(); ++i) {
    photographs.images.push_back(test::photograph(scene, code.pattern(i)));
    photographs.names.push_back(fmt::format("{:02}.png", i));
  }
  return photographs;
}

/// Noise and whole codes of so many bits; values beyond them are cut off.
void expose(CodePhotographs& photographs, double noise, int bits, std::uint64_t seed) {
  std::uint64_t counter = seed << 32;
  const double most = std::pow(2.0, bits) - 1;
  for (auto& image : photographs.images)
    for (float& v : image.values())
      v = static_cast<float>(
          std::round(most * std::clamp(static_cast<double>(v) + noise * test::normal(counter), 0.0, 1.0)) /
          most);
}

std::string refusal(const CodePhotographs& photographs) {
  const auto result = calibration::check_sequence(photographs, {});
  return result.ok() ? std::string() : result.error().line();
}

/// The picture lies in the middle of a camera picture that is 1 / share as large, the rest unlit.
CodePhotographs within(const CodePhotographs& lit, double share, double ambient) {
  const Grid small = lit.camera();
  const double side = 1 / std::sqrt(share);
  const Grid large{static_cast<int>(small.rows * side), static_cast<int>(small.cols * side)};
  CodePhotographs all{lit.code, lit.names, {}};
  for (const auto& image : lit.images) {
    Image<float> picture(large, 1, static_cast<float>(ambient));
    for (int r = 0; r < small.rows; ++r)
      for (int c = 0; c < small.cols; ++c)
        picture.at(r + (large.rows - small.rows) / 2, c + (large.cols - small.cols) / 2) =
            image.at(r, c) + static_cast<float>(ambient) - 0.03F;
    all.images.push_back(std::move(picture));
  }
  return all;
}

struct Kind {
  double share, noise, ambient;
  int bits;
};
class GoodSequence : public testing::TestWithParam<Kind> {};

// The projector covers a part of the picture; hot pixels are full in every photograph.
TEST_P(GoodSequence, is_not_refused) {
  static const CodePhotographs scene = clean({});
  const Kind& p = GetParam();
  CodePhotographs photographs = within(scene, p.share, p.ambient);
  for (auto& image : photographs.images)
    for (std::size_t i = 17; i < image.values().size(); i += 997) image.values()[i] = 1;
  expose(photographs, p.noise, p.bits, 3);
  EXPECT_EQ(refusal(photographs), "");
}
INSTANTIATE_TEST_SUITE_P(Kinds, GoodSequence,
                         testing::Values(Kind{0.02, 0.004, 0.03, 8}, Kind{0.02, 0.02, 0.03, 16},
                                         Kind{0.1, 0.001, 0.03, 16}, Kind{0.1, 0.03, 0.2, 16},
                                         Kind{0.25, 0.0001, 0.03, 8}, Kind{0.25, 0.01, 0.03, 16},
                                         Kind{0.25, 0.03, 0.1, 16}, Kind{0.6, 0.01, 0.03, 16},
                                         Kind{1, 1e-6, 0.03, 16}, Kind{1, 0.004, 0.1, 8},
                                         Kind{1, 0.04, 0.03, 16}));

TEST(GoodSequence, dark_and_noisy_pictures_of_a_quarter_are_decoded) {
  CodePhotographs photographs = within(clean({}), 0.25, 0.03);
  for (auto& image : photographs.images)
    for (float& v : image.values()) v *= 0.3F;
  expose(photographs, 0.004, 16, 5);
  const auto map = decode(photographs);
  ASSERT_TRUE(map.ok()) << map.error().line();
  EXPECT_GT(map->decoded_share(), 0.15);
}

/// The camera sees the corner of a large projector, a hundredth of it: one side of the coarse stripes only.
const CodePhotographs& corner() {
  static const CodePhotographs photographs =
      test::photograph_sequence({.projector = {768, 1024}, .blur = 0.9, .noise = 0.01}, 7);
  return photographs;
}

TEST(SmallPartOfTheProjector, is_not_refused) {
  const auto map = decode(corner());
  ASSERT_TRUE(map.ok()) << map.error().line();
  EXPECT_GT(map->decoded_share(), 0.8);
}

// Stripes that the camera sees change: their faults are found, as in a picture of the whole projector.
TEST(SmallPartOfTheProjector, swapped_pairs_are_named) {
  const std::size_t rows = corner().code.column_bits();
  for (const std::size_t pair : {5UL, 6UL, 7UL, 8UL, 9UL, rows + 5, rows + 6, rows + 7, rows + 8, rows + 9}) {
    CodePhotographs photographs = corner();
    std::swap(photographs.images[2 * pair], photographs.images[2 * pair + 1]);
    const std::string line = refusal(photographs);
    EXPECT_NE(line.find(photographs.names[2 * pair] + " and "), std::string::npos) << pair << line;
  }
}

TEST(SmallPartOfTheProjector, stripes_in_place_of_others_are_named) {
  const std::size_t rows = corner().code.column_bits();
  for (const std::size_t pair : {6UL, 8UL, rows + 6, rows + 8}) {
    CodePhotographs photographs = corner();
    std::swap(photographs.images[2 * pair], photographs.images[2 * pair + 2]);
    std::swap(photographs.images[2 * pair + 1], photographs.images[2 * pair + 3]);
    const std::string line = refusal(photographs);
    EXPECT_NE(line.find(photographs.names[2 * pair] + " and "), std::string::npos) << pair << line;
  }
}

/// One good sequence, and what faults make of it.
class Faults : public testing::Test {
 protected:
  static const CodePhotographs& good() { return test::default_photographs(); }
  static int count() { return good().code.photographs(); }
  static int pairs() { return good().code.pairs(); }
  static Image<float>& at(CodePhotographs& photographs, int k) { return photographs.images[k]; }
  static std::string name(int k) { return good().names[k]; }
  static bool names(const std::string& line, int k) {
    const std::string text = line + " ";
    for (std::size_t from = text.find(name(k)); from != std::string::npos;
         from = text.find(name(k), from + 1))
      if (std::isdigit(static_cast<unsigned char>(text[from + name(k).size()])) == 0) return true;
    return false;
  }
  /// Refused with one of the guilty among the photographs that are named, or with a place next to one, or
  /// decoded to the same positions.
  static void expect_right(const CodePhotographs& photographs, const std::vector<int>& guilty,
                           const std::string& fault) {
    const auto map = decode(photographs);
    if (!map.ok()) {
      const std::string line = map.error().line();
      bool named = line.find("no pixel could be decoded") != std::string::npos;
      for (const int k : guilty) named = named || names(line, k);
      EXPECT_TRUE(named) << fault << ": " << line;
      return;
    }
    static const PixelMap truth = decode(good()).value();
    double wrong = 0, all = 0;
    for (std::size_t i = 0; i < truth.mask.values().size(); ++i) {
      if (!map->mask.values()[i]) continue;
      all += 1;
      const bool off = !truth.mask.values()[i] ||
                       std::abs(map->col.values()[i] - truth.col.values()[i]) > 1.5F ||
                       std::abs(map->row.values()[i] - truth.row.values()[i]) > 1.5F;
      wrong += off ? 1 : 0;
    }
    EXPECT_LE(wrong, 0.005 * all) << fault << " is accepted";
  }
};

TEST_F(Faults, a_black_photograph_anywhere) {
  for (int k = 0; k < good().code.white(); ++k) {
    CodePhotographs photographs = good();
    at(photographs, k) = good().black();
    expect_right(photographs, {k}, fmt::format("black at {}", k));
    for (float& v : at(photographs, k).values()) v = 0;
    expect_right(photographs, {k}, fmt::format("nothing at {}", k));
  }
}

TEST_F(Faults, a_photograph_that_is_a_copy_of_another) {
  for (int k = 0; k < count(); ++k)
    for (const int from : {k - 2, k + 1, k + 2, (k + 9) % count()}) {
      if (from < 0 || from >= count()) continue;
      CodePhotographs photographs = good();
      at(photographs, k) = good().image(from);
      expect_right(photographs, {k}, fmt::format("{} is a copy of {}", k, from));
    }
}

TEST_F(Faults, two_photographs_exchanged) {
  for (int a = 0; a < count(); ++a)
    for (int b = a + 1; b < count(); b += 3) {
      CodePhotographs photographs = good();
      std::swap(at(photographs, a), at(photographs, b));
      expect_right(photographs, {a, b}, fmt::format("{} and {} exchanged", a, b));
    }
}

TEST_F(Faults, a_pair_that_is_inverted_copied_or_exchanged) {
  for (int a = 0; a < pairs(); ++a) {
    CodePhotographs photographs = good();
    std::swap(at(photographs, 2 * a), at(photographs, 2 * a + 1));
    expect_right(photographs, {2 * a}, fmt::format("pair {} inverted", a));
    for (int b = 0; b < pairs(); ++b) {
      if (a == b) continue;
      photographs = good();
      at(photographs, 2 * a) = good().image(2 * b);
      at(photographs, 2 * a + 1) = good().image(2 * b + 1);
      expect_right(photographs, {2 * a}, fmt::format("pair {} is a copy of {}", a, b));
      at(photographs, 2 * b) = good().image(2 * a);
      at(photographs, 2 * b + 1) = good().image(2 * a + 1);
      if (b > a) expect_right(photographs, {2 * a, 2 * b}, fmt::format("pairs {} and {} exchanged", a, b));
    }
  }
}

TEST_F(Faults, a_lamp_or_a_pose_that_changes) {
  // The camera then looks 6 pixels further down and 9 to the right.
  const auto moved = [](int photograph) {
    const Image<float>& still = good().image(photograph);
    Image<float> image(still.grid());
    for (int r = 0; r < image.grid().rows; ++r)
      for (int c = 0; c < image.grid().cols; ++c)
        image.at(r, c) =
            still.at(std::min(r + 6, image.grid().rows - 1), std::min(c + 9, image.grid().cols - 1));
    return image;
  };
  for (int k = 1; k < count(); ++k) {
    const std::vector<int> near{
        k - 3, k - 2, k - 1, k, std::min(k + 1, count() - 1), std::min(k + 2, count() - 1)};
    std::vector<int> place;
    for (const int n : near)
      if (n >= 0) place.push_back(n);
    CodePhotographs dim = good(), pose = good();
    for (int j = k; j < count(); ++j) {
      for (float& v : at(dim, j).values()) v *= 0.7F;
      at(pose, j) = moved(j);
    }
    expect_right(dim, place, fmt::format("lamp changed before {}", k));
    expect_right(pose, place, fmt::format("pose changed before {}", k));
  }
}

// Positions reach to column 97 and row 75; of 7 + 7 bits.
TEST_F(Faults, a_projector_that_is_too_small) {
  for (const Grid wrong : {Grid{100, 80}, Grid{65, 100}, Grid{80, 70}, Grid{128, 90}}) {
    CodePhotographs photographs = good();
    photographs.code = GrayCode(wrong);
    const std::string line = refusal(photographs);
    EXPECT_NE(line.find("larger than " + to_string(wrong)), std::string::npos) << line;
  }
  for (const Grid larger : {Grid{80, 100}, Grid{128, 128}}) {
    CodePhotographs photographs = good();
    photographs.code = GrayCode(larger);
    EXPECT_EQ(refusal(photographs), "");
  }
}

/// Each cell is 4 × 4 pixels. Cell (r, c) shows position (r + top, c + left) of its code. The camera sees the
/// rows from `first` on.
CodePhotographs offset_code(Grid size, int top, int left, int first = 0) {
  const GrayCode code(size);
  const GrayCode whole(Grid{1 << code.bits(StripeAxis::rows), 1 << code.bits(StripeAxis::columns)});
  CodePhotographs photographs{code, {}, {}};
  std::uint64_t counter = 11ULL << 32;
  for (int k = 0; k < code.photographs(); ++k) {
    const Pattern pattern = whole.pattern(k);
    Image<float> image(Grid{4 * (size.rows - first) + 20, 4 * size.cols + 20}, 1, 0.05F);
    for (int r = 0; r < image.grid().rows; ++r)
      for (int c = 0; c < image.grid().cols; ++c) {
        const int y = (r - 10) / 4 + first, x = (c - 10) / 4;
        if (r >= 10 && c >= 10 && y < size.rows && x < size.cols)
          image.at(r, c) += 0.5F * pattern.at(y + top, x + left);
        image.at(r, c) += 0.004F * static_cast<float>(test::normal(counter));
      }
    photographs.images.push_back(std::move(image));
    photographs.names.push_back(fmt::format("{:02}.png", k));
  }
  return photographs;
}

// 24 rows of 32 positions are 4 to 27, and 40 columns of 64 are 12 to 51.
TEST(CentredCode, is_named_and_not_taken_for_a_larger_projector) {
  for (const Grid size : {Grid{24, 32}, Grid{32, 40}, Grid{24, 40}, Grid{28, 32}}) {
    const GrayCode code(size);
    const int top = ((1 << code.bits(StripeAxis::rows)) - size.rows) / 2,
              left = ((1 << code.bits(StripeAxis::columns)) - size.cols) / 2;
    EXPECT_NE(refusal(offset_code(size, top, left)).find("lies in the middle of its code"),
              std::string::npos);
    EXPECT_EQ(refusal(offset_code(size, 0, 0)), "");
  }
}

// Rows 4 to 23 become 27 to 8 if the coarsest pair is swapped: they look like those of a centred code, but
// run backwards.
TEST(CentredCode, is_not_said_first_of_a_swapped_pair) {
  CodePhotographs photographs = offset_code({24, 32}, 0, 0, 4);
  EXPECT_EQ(refusal(photographs), "");
  std::swap(photographs.images[10], photographs.images[11]);
  const std::string line = refusal(photographs);
  const auto swapped = line.find("10.png and 11.png (rows, 16 px) are swapped");
  EXPECT_NE(swapped, std::string::npos) << line;
  EXPECT_LT(swapped, line.find("lies in the middle of its code")) << line;
}

TEST_F(Faults, are_decoded_all_the_same_when_asked_so) {
  CodePhotographs photographs = good();
  std::swap(at(photographs, 4), at(photographs, 5));
  EXPECT_FALSE(decode(photographs).ok());
  DecodeOptions options;
  options.check_sequence = false;
  EXPECT_TRUE(decode(photographs, options).ok());
}

}  // namespace
}  // namespace symrig::sequence_faults_test
