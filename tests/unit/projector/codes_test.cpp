// SPDX-License-Identifier: Apache-2.0
#include "assert_ok.hpp"
#include "symrig/projector/placement.hpp"

#include <cmath>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace symrig::test::codes_test {
namespace {

std::vector<double> gamma_response(double exponent, double black, double white) {
  std::vector<double> light(256);
  for (std::size_t code = 0; code < light.size(); ++code)
    light[code] = black + (white - black) * std::pow(static_cast<double>(code) / 255, exponent);
  return light;
}

TEST(Codes, without_a_response_every_code_is_reached_by_its_own_value) {
  const CodeTable table;
  for (int code = 0; code < 256; ++code) {
    EXPECT_EQ(table.code(static_cast<float>(code) / 255.F), code);
    // Just within half a code of it.
    EXPECT_EQ(table.code(static_cast<float>((code + 0.499) / 255)), code);
    if (code > 0) {
      EXPECT_EQ(table.code(static_cast<float>((code - 0.499) / 255)), code);
    }
  }
}

TEST(Codes, binary_values_are_0_and_255_whatever_the_response) {
  for (const double exponent : {0.3, 1., 2.2, 8.}) {
    const auto table = CodeTable::from_light(gamma_response(exponent, 3, 70));
    ASSERT_OK(table);
    EXPECT_EQ(table->code(0), 0);
    EXPECT_EQ(table->code(1), 255);
  }
  std::vector<double> flat_end(256, 1);
  flat_end[0] = 0;
  const auto table = CodeTable::from_light(flat_end);
  ASSERT_OK(table);
  EXPECT_EQ(table->code(1), 255);
  EXPECT_EQ(table->code(0.9F), 1) << "of equally bright codes the lowest";
}

RC_GTEST_PROP(Codes, no_other_code_is_nearer_to_the_light_asked_for, ()) {
  std::vector<double> light(256);
  for (double& value : light) value = *rc::gen::inRange(0, 5);  // with plateaus
  light[0] += 1;
  std::partial_sum(light.begin(), light.end(), light.begin());
  RC_PRE(light.back() > light.front());
  const auto table = CodeTable::from_light(light);
  RC_ASSERT(table.ok());
  const float v = static_cast<float>(*rc::gen::inRange(0, 1001)) / 1000.F;
  const double wanted = light.front() + double{v} * (light.back() - light.front());
  const double got = std::abs(light[table->code(v)] - wanted);
  // Both sides are rounded once or twice: a few ulps of the largest light, at most 1021.
  for (const double each : light) RC_ASSERT(got <= std::abs(each - wanted) + 1e-9);
}

TEST(Codes, responses_that_tell_nothing_are_refused) {
  EXPECT_EQ(CodeTable::from_light(std::vector<double>(255, 1)).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(CodeTable::from_light(std::vector<double>(256, 1)).error().code, ErrorCode::bad_value);
  auto falling = gamma_response(2, 0, 1);
  falling[100] = falling[99] - 0.001;
  EXPECT_EQ(CodeTable::from_light(falling).error().code, ErrorCode::bad_value);
  falling[100] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(CodeTable::from_light(falling).error().code, ErrorCode::bad_value);
  falling = gamma_response(2, 0, 1);
  falling.back() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(CodeTable::from_light(falling).error().code, ErrorCode::bad_value);
}

TEST(Codes, a_pattern_names_its_bad_value) {
  Pattern pattern({3, 4});
  ASSERT_OK(to_codes(pattern, {3, 4}, {}, 0));
  for (const float bad : {-0.01F, 1.01F, std::numeric_limits<float>::quiet_NaN()}) {
    pattern.at(2, 1) = bad;
    const auto codes = to_codes(pattern, {3, 4}, {}, 7);
    ASSERT_FALSE(codes.ok());
    EXPECT_EQ(codes.error().code, ErrorCode::bad_value);
    EXPECT_NE(codes.error().what.find("pattern 7"), std::string::npos) << codes.error().what;
    EXPECT_NE(codes.error().what.find("row 2, column 1"), std::string::npos) << codes.error().what;
  }
  EXPECT_EQ(to_codes(Pattern({4, 3}), {3, 4}, {}, 0).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(to_codes(Pattern({3, 4}, 3), {3, 4}, {}, 0).error().code, ErrorCode::size_mismatch);
}

}  // namespace
}  // namespace symrig::test::codes_test
