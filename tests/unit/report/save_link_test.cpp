// SPDX-License-Identifier: Apache-2.0
#include "report/save_link.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace symrig::report::save_link_test {
namespace {

TEST(SaveLink, names_of_files_are_plain) {
  EXPECT_EQ(file_stem("a scene"), "a-scene");
  EXPECT_EQ(file_stem("../../etc/passwd"), "etc-passwd");
  EXPECT_EQ(file_stem("\"><script>"), "script");
  EXPECT_EQ(file_stem("///"), "symrig");
  EXPECT_EQ(file_stem(""), "symrig");
  EXPECT_LE(file_stem(std::string(1000, 'x')).size(), 100U);
}

TEST(SaveLink, csv_quotes_and_disarms) {
  Csv csv({"name", "value"});
  csv.add({"a,b", "1.5"});
  csv.add({"=1+2", "-0.5"});
  csv.add({"say \"x\"", "1e-07"});
  EXPECT_EQ(csv.text(), "name,value\r\n\"a,b\",1.5\r\n'=1+2,-0.5\r\n\"say \"\"x\"\"\",1e-07\r\n");
}

TEST(SaveLink, exact_numbers_read_back) {
  EXPECT_EQ(std::stod(exact(0.1 + 0.2)), 0.1 + 0.2);
  EXPECT_EQ(exact(std::numeric_limits<double>::infinity()), "");
}

TEST(SaveLink, only_finite_pictures_of_some_size_become_openexr) {
  Image<float> image({2, 2}, 1, 1.0F);
  EXPECT_NE(exr_link("f", "a picture", image), "");
  image.at(0, 0) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(exr_link("f", "a picture", image), "");
  EXPECT_EQ(exr_link("f", "a picture", Image<float>({600, 600})), "");
}

}  // namespace
}  // namespace symrig::report::save_link_test
