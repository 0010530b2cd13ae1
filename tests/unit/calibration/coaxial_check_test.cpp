// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/coaxial_check.hpp"

#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include <gtest/gtest.h>

namespace symrig::coaxial_check_test {
namespace {

CoaxialCheck check(const std::string& uri) {
  auto rig = open_virtual_rig(uri);
  EXPECT_TRUE(rig.ok()) << rig.error().line();
  auto found = check_coaxial(**rig);
  EXPECT_TRUE(found.ok()) << found.error().line();
  return *std::move(found);
}

// Whatever is in the scene, a coaxial rig measures a symmetric T. 5 sigmas, and the smallest value on top:
// the sigmas hold all that differs.
class Coaxial : public testing::TestWithParam<std::string> {};

TEST_P(Coaxial, raises_no_alarm) {
  for (const std::string seed : {"1", "2", "3"}) {
    const CoaxialCheck found = check(GetParam() + "&seed=" + seed);
    EXPECT_TRUE(found.measured());
    EXPECT_FALSE(found.misaligned()) << found.to_string();
    EXPECT_FALSE(found.flaring()) << found.to_string();
    EXPECT_FALSE(found.doubled()) << found.to_string();
    EXPECT_EQ(found.to_string().rfind("coaxial: ", 0), 0U) << found.to_string();
    EXPECT_LE(found.photographs,
              10);  // eight, and one more an axis where a mirror looks like a second picture
  }
}
INSTANTIATE_TEST_SUITE_P(
    Rigs, Coaxial,
    testing::Values("sim:vgroove-textured?size=64x64", "sim:vgroove-textured?size=128x128",
                    "sim:vgroove-textured?size=64x64&psf=0.1", "sim:vgroove-textured?size=64x64&dead=0.01",
                    "sim:vgroove-textured?size=64x64&dead=0.05&psf=0.1", "sim:plane?size=64x64",
                    "sim:plane?size=64x64&psf=0.1&dead=0.01", "sim:gummy?size=64x64", "sim:mirror?size=61x67",
                    "sim:occluder?size=64x64", "sim:views2?size=64x64&black=0.02",
                    "sim:gummy?size=50x60&channels=3", "sim:vgroove-textured?size=64x64&noise=off",
                    "sim:vgroove-textured?size=64x64&drift=0.01", "sim:plane?size=1x97"));

struct Shift {
  std::string scene;
  double pixels;
};
class Misaligned : public testing::TestWithParam<Shift> {};

// A bilinear shift by m moves m of the direct light, whose texture differs from one stripe to the next: the
// scale is good to a tenth (the stated error), and camera noise is far below 1 % of 0.02 pixels.
TEST_P(Misaligned, is_told_by_how_much) {
  const double m = GetParam().pixels;
  const CoaxialCheck found = check(GetParam().scene + "&misalign=" + std::to_string(m));
  EXPECT_TRUE(found.misaligned());
  EXPECT_FALSE(found.flaring()) << found.to_string();
  EXPECT_FALSE(found.doubled()) << found.to_string();
  for (const AxisCheck& axis : {found.rows, found.cols}) {
    EXPECT_NEAR(axis.shift.value, m, 0.1 * std::abs(m)) << found.to_string();
    EXPECT_GE(axis.shift.significance(), 5);
  }
  EXPECT_EQ(found.to_string().rfind("misaligned: ", 0), 0U) << found.to_string();
}
INSTANTIATE_TEST_SUITE_P(Rigs, Misaligned,
                         testing::Values(Shift{"sim:vgroove-textured?size=64x64", 0.02},
                                         Shift{"sim:vgroove-textured?size=64x64", 0.1},
                                         Shift{"sim:vgroove-textured?size=64x64", 0.3},
                                         Shift{"sim:vgroove-textured?size=64x64", -0.3},
                                         Shift{"sim:vgroove-textured?size=128x128", 0.02},
                                         Shift{"sim:vgroove-textured?size=128x128", 0.1},
                                         Shift{"sim:vgroove-textured?size=128x128", 0.3},
                                         Shift{"sim:vgroove-textured?size=64x64&psf=0.1", 0.1},
                                         Shift{"sim:vgroove-textured?size=64x64&dead=0.01", 0.1},
                                         Shift{"sim:vgroove-textured?size=64x64&noise=off", 0.02},
                                         Shift{"sim:plane?size=64x64", -0.02},
                                         Shift{"sim:occluder?size=64x64&psf=0.05", 0.1}));

struct Flaring {
  std::string scene;
  double share;
};
class OneSidedFlare : public testing::TestWithParam<Flaring> {};

// The flare goes down and to the right over a tenth of the longer side. A tenth of it falls over the border,
// another is light that a fitted length off by a tenth puts elsewhere, and stripes that have less light than
// their neighbourhood count a tenth too little: a third in all.
TEST_P(OneSidedFlare, is_told_from_misalignment_with_its_share) {
  const CoaxialCheck found = check(GetParam().scene + "&flare=" + std::to_string(GetParam().share));
  EXPECT_TRUE(found.flaring()) << found.to_string();
  EXPECT_FALSE(found.misaligned()) << found.to_string();
  EXPECT_FALSE(found.doubled()) << found.to_string();
  for (const AxisCheck& axis : {found.rows, found.cols}) {
    EXPECT_NEAR(axis.flare.value, GetParam().share, GetParam().share / 3) << found.to_string();
    EXPECT_GE(axis.flare_significance, 5);
  }
  EXPECT_NE(found.to_string().find("downwards"), std::string::npos) << found.to_string();
  EXPECT_NE(found.to_string().find("to the right"), std::string::npos) << found.to_string();
}
INSTANTIATE_TEST_SUITE_P(Rigs, OneSidedFlare,
                         testing::Values(Flaring{"sim:vgroove-textured?size=64x64", 0.002},
                                         Flaring{"sim:vgroove-textured?size=64x64", 0.01},
                                         Flaring{"sim:vgroove-textured?size=64x64", 0.05},
                                         Flaring{"sim:vgroove-textured?size=128x128", 0.002},
                                         Flaring{"sim:vgroove-textured?size=128x128", 0.01},
                                         Flaring{"sim:vgroove-textured?size=128x128", 0.05},
                                         Flaring{"sim:plane?size=64x64&psf=0.1", 0.01}));

/// A rig whose camera sees everything a second time, weaker and some pixels off: photograph + share ·
/// photograph(x − off).
class SecondPicture final : public Probe {
 public:
  SecondPicture(std::unique_ptr<Probe> rig, double share, int rows, int cols)
      : rig_(std::move(rig)), share_(static_cast<float>(share)), rows_(rows), cols_(cols) {}
  Grid grid() const override { return rig_->grid(); }
  int channels() const override { return rig_->channels(); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    SYMRIG_TRY(auto photographs, rig_->measure(patterns));
    for (Radiance& one : photographs) double_it(one);
    return photographs;
  }
  ProbeCost cost() const override { return rig_->cost(); }
  std::string describe() const override { return rig_->describe(); }

 private:
  void double_it(Radiance& photograph) const {
    const Radiance first = photograph;
    const Grid size = grid();
    for (int channel = 0; channel < channels(); ++channel)
      for (int r = std::max(rows_, 0); r < std::min(size.rows, size.rows + rows_); ++r)
        for (int c = std::max(cols_, 0); c < std::min(size.cols, size.cols + cols_); ++c) {
          photograph.mean.at(r, c, channel) += share_ * first.mean.at(r - rows_, c - cols_, channel);
          photograph.variance.at(r, c, channel) +=
              share_ * share_ * first.variance.at(r - rows_, c - cols_, channel);
        }
  }

  std::unique_ptr<Probe> rig_;
  float share_;
  int rows_, cols_;
};

struct Second {
  std::string scene;
  double share;
  int rows, cols;
};
class DoubleImage : public testing::TestWithParam<Second> {};

// The share is of the direct light of stripes whose texture differs from that of their second places: by a
// third at most, as of a flare; where it falls over the border a quarter of one stripe in four is lost.
TEST_P(DoubleImage, is_told_from_the_others_with_its_place) {
  const Second& p = GetParam();
  auto rig = open_virtual_rig(p.scene);
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  SecondPicture probe(*std::move(rig), p.share, p.rows, p.cols);
  const auto found = check_coaxial(probe);
  ASSERT_TRUE(found.ok()) << found.error().line();
  EXPECT_TRUE(found->doubled()) << found->to_string();
  EXPECT_FALSE(found->misaligned()) << found->to_string();
  EXPECT_FALSE(found->flaring()) << found->to_string();
  EXPECT_EQ(found->to_string().rfind("double image: ", 0), 0U) << found->to_string();
  const auto expect = [&](const AxisCheck& axis, int off) {
    EXPECT_EQ(axis.second_shift, off) << found->to_string();
    EXPECT_NEAR(axis.second.value, off == 0 ? 0 : p.share, p.share / 3) << found->to_string();
  };
  expect(found->rows, p.rows);
  expect(found->cols, p.cols);
}
INSTANTIATE_TEST_SUITE_P(Rigs, DoubleImage,
                         testing::Values(Second{"sim:vgroove-textured?size=64x64", 0.02, 0, 7},
                                         Second{"sim:vgroove-textured?size=64x64", 0.02, 9, 0},
                                         Second{"sim:vgroove-textured?size=64x64", 0.02, -7, 6},
                                         Second{"sim:vgroove-textured?size=128x128", 0.005, 0, -11},
                                         Second{"sim:vgroove-textured?size=128x128", 0.05, 20, 9},
                                         Second{"sim:plane?size=128x128&psf=0.1", 0.01, 0, 23},
                                         Second{"sim:gummy?size=128x128", 0.05, 12, 0}));

// Beyond a pixel the shift is still told, roughly: by the first moment of light up to three pixels away.
TEST(Misalignment, of_more_than_a_pixel_is_told_to_a_fifth) {
  const CoaxialCheck found = check("sim:plane?size=64x64&misalign=1.5");
  EXPECT_TRUE(found.misaligned());
  EXPECT_NEAR(found.cols.shift.value, 1.5, 0.3);
  EXPECT_NEAR(found.rows.shift.value, 1.5, 0.3);
}

TEST(CoaxialCheck, says_when_it_cannot_tell) {
  const CoaxialCheck found = check("sim:plane?size=1x1");
  EXPECT_FALSE(found.measured());
  EXPECT_FALSE(found.misaligned());
  EXPECT_EQ(found.photographs, 0);
  EXPECT_EQ(found.to_string(), "coaxial check: not possible, too few pixels or too little light");
}

/// Answers every pattern with one value.
class Constant final : public Probe {
 public:
  explicit Constant(float value) : value_(value) {}
  Grid grid() const override { return {20, 30}; }
  int channels() const override { return 1; }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    const Radiance photograph{Image<float>(grid(), 1, value_), Image<float>(grid(), 1, 1e-6F),
                              Image<std::uint8_t>(grid(), 1, 1)};
    return std::vector<Radiance>(patterns.size(), photograph);
  }
  ProbeCost cost() const override { return {}; }
  std::string describe() const override { return "constant"; }

 private:
  float value_;
};

TEST(CoaxialCheck, finds_nothing_in_the_dark) {
  for (const float value : {0.0F, 1.0F}) {  // black, and light that does not come from the projector
    Constant probe(value);
    const auto found = check_coaxial(probe);
    ASSERT_TRUE(found.ok());
    EXPECT_FALSE(found->measured()) << value;
  }
}

TEST(CoaxialCheck, refuses_photographs_that_are_not_numbers) {
  Constant probe(std::numeric_limits<float>::quiet_NaN());
  const auto found = check_coaxial(probe);
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::bad_value);
}

}  // namespace
}  // namespace symrig::coaxial_check_test
