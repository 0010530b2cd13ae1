// SPDX-License-Identifier: Apache-2.0
// 42 real photographs of a projector and a camera, where they are: SYMRIG_PHOTOGRAPHS in the environment, or
// as configured.
#include "symrig/calibration/first_bounce.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

namespace symrig {
namespace {

std::filesystem::path photographs_folder() {
  const char* folder = std::getenv("SYMRIG_PHOTOGRAPHS");  // NOLINT(concurrency-mt-unsafe): before any thread
  return folder ? folder : SYMRIG_PHOTOGRAPHS;
}

class RealPhotographs : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!std::filesystem::is_directory(photographs_folder())) return;
    auto read = read_gray_code_folder(photographs_folder());
    ASSERT_TRUE(read.ok()) << read.error().line();
    photographs_ = new CodePhotographs(*std::move(read));
  }
  static void TearDownTestSuite() { delete photographs_; }
  void SetUp() override {
    if (!photographs_)
      GTEST_SKIP() << "no photographs in " << photographs_folder()
                   << "; set SYMRIG_PHOTOGRAPHS to their folder";
  }

  static CodePhotographs* photographs_;
};
CodePhotographs* RealPhotographs::photographs_ = nullptr;

TEST_F(RealPhotographs, AreASequenceOf768x1024) {
  EXPECT_EQ(photographs_->code.projector(), (Grid{768, 1024}));
  EXPECT_EQ(photographs_->camera(), (Grid{1024, 1280}));
}

TEST_F(RealPhotographs, DecodeSmoothly) {
  const auto map = decode(*photographs_);
  ASSERT_TRUE(map.ok()) << map.error().line();
  EXPECT_GE(map->decoded_share(), 0.70);  // the rest is in shadow, on black paper or on translucent tape
  // The board is flat: neighbours differ by the map's scale (0.6), far below 2 projector pixels, except at
  // the few edges.
  std::int64_t pairs = 0, jumps = 0;
  for (int r = 0; r < 1024; ++r)
    for (int c = 1; c < 1280; ++c) {
      if (!map->mask.at(r, c) || !map->mask.at(r, c - 1)) continue;
      ++pairs;
      jumps += std::abs(map->col.at(r, c) - map->col.at(r, c - 1)) > 2 ? 1 : 0;
    }
  EXPECT_LE(static_cast<double>(jumps), 1e-3 * static_cast<double>(pairs));
}

class RealHeldOut : public RealPhotographs, public testing::WithParamInterface<int> {};

TEST_P(RealHeldOut, PairIsPredicted) {
  const auto fit = fit_first_bounce(*photographs_, {.decode = {.held_out_pair = GetParam()}});
  ASSERT_TRUE(fit.ok()) << fit.error().line();
  ASSERT_EQ(fit->errors.size(), 2U);
  ASSERT_GE(photographs_->code.pair(GetParam()).stripe_width, 64);
  RecordProperty("stripes", fit->errors[0].name);
  RecordProperty("pattern_percent_of_mean_white", std::to_string(100 * fit->errors[0].rms_lit));
  RecordProperty("complement_percent_of_mean_white", std::to_string(100 * fit->errors[1].rms_lit));
  for (const PredictionError& error : fit->errors) {
    EXPECT_LE(error.rms_lit, 0.08) << error.name;
    EXPECT_GT(error.rms_lit, 0.01) << error.name;  // below the noise of one photograph: the fit has seen it
  }
}
// All pairs with stripes of at least 64 px, columns and rows.
INSTANTIATE_TEST_SUITE_P(Pairs, RealHeldOut, testing::Values(0, 1, 2, 3, 4, 10, 11, 12, 13, 14));

}  // namespace
}  // namespace symrig
