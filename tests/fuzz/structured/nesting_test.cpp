// SPDX-License-Identifier: Apache-2.0
// Texts that nest so deep that a parser, or the tree it makes, would use up the stack.
#include "symrig/base/nesting.hpp"

#include "scratch.hpp"
#include "symrig/base/atomic_file.hpp"
#include "symrig/calibration/capture_file.hpp"
#include "symrig/hdr/response_file.hpp"
#include "symrig/hdr/sensor.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/rig/rig_description.hpp"

#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::structured::nesting_test {
namespace {

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int k = 0; k < times; ++k) all += text;
  return all;
}

constexpr int kDeep = 20'000;

TEST(Nesting, of_toml_is_bounded_in_every_form) {
  const std::string dots = repeated("a.", kDeep);
  for (const std::string& text :
       {fmt::format("{}a = 1\n", dots), fmt::format("[{}a]\nb = 1\n", dots),
        fmt::format("[[{}a]]\nb = 1\n", repeated("a . ", kDeep)),
        fmt::format("{}a = 1\n", repeated("'a'.", kDeep)), fmt::format("a = {}", std::string(kDeep, '[')),
        fmt::format("a = {}1", repeated("{ a = ", kDeep)),
        fmt::format("x = 'a'\ny = {{ {}c = 1 }}\n", dots)}) {
    const auto checked = check_toml_nesting(text, "a.toml");
    ASSERT_FALSE(checked.ok()) << text.substr(0, 40);
    EXPECT_EQ(checked.error().code, ErrorCode::bad_format);
    EXPECT_NE(checked.error().what.find("a.toml:"), std::string::npos);
    const auto program = parse_program_file(text, "a.toml", "");
    ASSERT_FALSE(program.ok());
    EXPECT_EQ(program.error().what, checked.error().what);
  }
}

TEST(Nesting, in_strings_and_comments_is_none) {
  const std::string many(1'000, '[');
  for (const std::string& text :
       {fmt::format("a = \"{}\"\n", many), fmt::format("a = '{}'\n", many), fmt::format("# {}\n", many),
        fmt::format("a = \"\"\"\n\\\"\"\"{}\"\"\"\"\"\nb = [1]\n", many),
        fmt::format("a = '''\n''{}'''''\n", many), fmt::format("a = \"\\\"{}\"\n", many),
        fmt::format("a = [{}2.5]\n", repeated("1.5, ", 1'000))})
    EXPECT_TRUE(check_toml_nesting(text, "a.toml").ok()) << text.substr(0, 20);
}

TEST(Nesting, is_counted_to_the_line) {
  const auto checked =
      check_toml_nesting(fmt::format("a = '''\n\n'''\n# x\nb = {}", std::string(65, '[')), "a.toml");
  ASSERT_FALSE(checked.ok());
  EXPECT_NE(checked.error().what.find("a.toml:5:"), std::string::npos) << checked.error().what;
  EXPECT_TRUE(check_toml_nesting(fmt::format("b = {}", std::string(64, '[')), "a.toml").ok());
}

TEST(Nesting, of_json_is_bounded) {
  EXPECT_FALSE(check_json_nesting(std::string(65, '[')).ok());
  EXPECT_FALSE(check_json_nesting(repeated(R"({"a":)", kDeep)).ok());
  EXPECT_TRUE(check_json_nesting(fmt::format("\"\\\"{}\"", std::string(1'000, '['))).ok());
  EXPECT_TRUE(check_json_nesting(fmt::format("[{}1]", repeated("[],", 1'000))).ok());
}

// Every kind of TOML file that commands read.
TEST(Nesting, of_every_toml_file_is_refused) {
  const test::Scratch folder;
  const auto file = folder / "deep.toml";
  ASSERT_TRUE(write_file_atomically(file, fmt::format("{}a = 1\n", repeated("a.", kDeep))).ok());
  EXPECT_EQ(load_sensor(file).error().code, ErrorCode::bad_format);
  EXPECT_EQ(load_response(file).error().code, ErrorCode::bad_format);
  EXPECT_EQ(read_rig_file(file).error().code, ErrorCode::bad_format);
  EXPECT_EQ(read_capture_file(file).error().code, ErrorCode::bad_format);
  EXPECT_EQ(read_program_file(file).error().code, ErrorCode::bad_format);
}

}  // namespace
}  // namespace symrig::structured::nesting_test
