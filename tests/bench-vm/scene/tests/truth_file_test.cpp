// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/truth_file.hpp"

#include "assert_ok.hpp"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

namespace symrig::bench_vm::truth_file_test {
namespace {

using namespace std::chrono_literals;

/// The exposure of a line with these lit pictures.
TrueExposure exposure_with(const std::string& lit) {
  const auto path = std::filesystem::temp_directory_path() / ("truth-" + std::to_string(::getpid()));
  std::ofstream(path) << R"({"exposed":7,"begin":1000,"end":2001000,"doubt":0,"lit":[)" << lit << "]}\n";
  const auto exposures = read_true_exposures(path.string());
  std::filesystem::remove(path);
  EXPECT_TRUE(exposures.ok());
  EXPECT_EQ(exposures->size(), 1U);
  return exposures->front();
}

TEST(TruthFile, knows_an_exposure_of_one_picture) {
  const TrueExposure seen = exposure_with(R"({"picture":3,"key":"91c2","share":1})");
  EXPECT_EQ(seen.frame, 7U);
  EXPECT_EQ(seen.open, 2ms);
  EXPECT_TRUE(seen.pure);
  EXPECT_EQ(seen.picture, 0x91c2U);
  EXPECT_EQ(seen.lit(), 2ms);
}

TEST(TruthFile, knows_an_exposure_that_goes_on_after_the_dark_time_between_refreshes) {
  const TrueExposure seen =
      exposure_with(R"({"picture":3,"key":"a","share":0.5},{"picture":4,"key":"d","share":0.05,"dark":true},)"
                    R"({"picture":5,"key":"a","share":0.45})");
  EXPECT_TRUE(seen.pure);
  EXPECT_EQ(seen.picture, 0xaU);
  EXPECT_EQ(seen.open, 2ms);
  EXPECT_EQ(seen.lit(), 1900us);
}

TEST(TruthFile, a_dark_exposure_is_one_of_a_dark_picture) {
  const TrueExposure seen = exposure_with(R"({"picture":4,"key":"d","share":1,"dark":true})");
  EXPECT_TRUE(seen.pure);
  EXPECT_EQ(seen.picture, 0xdU);
  EXPECT_EQ(seen.lit(), 2ms);
}

TEST(TruthFile, an_exposure_of_two_pictures_or_mostly_in_the_dark_is_not_pure) {
  EXPECT_FALSE(
      exposure_with(R"({"picture":3,"key":"a","share":0.99},{"picture":4,"key":"b","share":0.01})").pure);
  EXPECT_FALSE(
      exposure_with(R"({"picture":3,"key":"a","share":0.6},{"picture":4,"key":"d","share":0.4,"dark":true})")
          .pure);
  EXPECT_FALSE(exposure_with(R"({"picture":3,"key":"a","share":0.95})").pure) << "no picture for a while";
}

}  // namespace
}  // namespace symrig::bench_vm::truth_file_test
