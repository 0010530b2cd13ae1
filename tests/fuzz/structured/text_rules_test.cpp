// SPDX-License-Identifier: Apache-2.0
// Texts that nest so deep that a parser, or the tree it makes, would use up the stack.
// Numbers that a receipt, a board file or a compiled program cannot have.
#include "campaign.hpp"
#include "scratch.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/internal/json_reader.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/calibration/capture_file.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/hdr/sensor.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/protocol/crc32c.hpp"
#include "symrig/protocol/types.hpp"
#include "symrig/rig/rig_file.hpp"

#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace symrig::structured::text_rules_test {
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

using Json = nlohmann::ordered_json;

Json receipt() {
  return Json::parse(receipt_json(run_once()));
}

void expect_refused(const Json& json, const std::string& word) {
  const auto run = read_receipt(json.dump());
  ASSERT_FALSE(run.ok()) << word;
  EXPECT_EQ(run.error().code, ErrorCode::bad_format);
  EXPECT_NE(run.error().what.find(word), std::string::npos) << run.error().line();
}

TEST(ReceiptRules, every_number_has_its_range) {
  const Json whole = receipt();
  ASSERT_TRUE(read_receipt(whole.dump()).ok());
  const auto with = [&whole](const char* path, const Json& value) {
    Json json = whole;
    json.at(Json::json_pointer(path)) = value;
    return json;
  };
  expect_refused(with("/board/tick_hz", 0), "tick_hz");
  expect_refused(with("/board/tick_hz", -1), "tick_hz");
  expect_refused(with("/board/tick_hz", 1.5), "tick_hz");
  expect_refused(with("/board/tick_hz", 1e30), "tick_hz");
  expect_refused(with("/board/tick_hz", 20'000'000'000), "tick_hz");
  expect_refused(with("/board/min_dwell", 0), "min_dwell");
  expect_refused(with("/board/program_bytes", 4'294'967'295), "program_bytes");
  expect_refused(with("/board/lines/1/name", whole.at("board").at("lines").at(0).at("name")), "two lines");
  expect_refused(with("/board/lines/1/name", "a\x1b[2J"), "control");
  expect_refused(with("/time/started_tick", ~0ULL), "started_tick");
  expect_refused(with("/planned/end", ~0ULL), "ticks since the start");
  expect_refused(with("/planned/listed", 3), "listed");
  expect_refused(with("/planned/count", 0), "count");
  expect_refused(with("/planned/edges/0/0", 31), "line of an edge");
  expect_refused(with("/planned/edges/0/0", std::int64_t{1} << 32), "line of an edge");
  expect_refused(with("/captured/edges/0/1", 2), "level of an edge");
  expect_refused(with("/captured/edges/0/2", std::int64_t{1} << 62), "ticks since the start");
  expect_refused(with("/lines/0/hazard", 3), "hazard");
  expect_refused(with("/lines/0/max_duty", -1), "max_duty");
}

TEST(ReceiptRules, deep_nesting_is_refused_before_it_is_parsed) {
  const std::string deep = R"({"format":"symrig-receipt","version":)" + std::string(200'000, '[');
  const auto run = read_receipt(deep + std::string(200'000, ']') + "}");
  ASSERT_FALSE(run.ok());
  EXPECT_NE(run.error().what.find("nests deeper"), std::string::npos);
  EXPECT_FALSE(parse_board_file(std::string(200'000, '[')).ok());
}

/// The file with another header and a checksum that is right.
std::vector<std::uint8_t> with_header(std::vector<std::uint8_t> file, const Json& header) {
  const std::size_t old = protocol::get_u32(file.data() + 12);
  const std::string text = header.dump();
  file.erase(file.begin() + 24, file.begin() + 24 + static_cast<std::ptrdiff_t>(old));
  file.insert(file.begin() + 24, text.begin(), text.end());
  protocol::put_u32(file.data() + 12, static_cast<std::uint32_t>(text.size()));
  protocol::put_u32(file.data() + 20, protocol::crc32c({file.data() + 24, file.size() - 24}));
  return file;
}

TEST(ProgramRules, the_header_says_what_the_records_say) {
  const auto whole = symprog_bytes(run_once().program);
  const std::size_t size = protocol::get_u32(whole.data() + 12);
  const Json header = Json::parse(whole.begin() + 24, whole.begin() + 24 + static_cast<std::ptrdiff_t>(size));
  ASSERT_TRUE(read_symprog(with_header(whole, header)).ok());
  const auto refused = [&](const char* path, const Json& value) {
    Json json = header;
    json.at(Json::json_pointer(path)) = value;
    const auto program = read_symprog(with_header(whole, json));
    EXPECT_FALSE(program.ok()) << path;
  };
  refused("/board/tick_hz", 0);
  refused("/longest_ns", -1);
  refused("/longest_ns", std::numeric_limits<std::int64_t>::max());
  refused("/longest_ns", 1);
  refused("/steps", 1);
  refused("/expected_ns", std::numeric_limits<std::int64_t>::max());
  refused("/program_hash", "00000000");
  refused("/config_hash", "00000000");
  refused("/lines/0/hazard", -1);
  refused("/lines/0/max_on_ns", std::numeric_limits<std::int64_t>::min());
  refused("/places/0", -1);
}

}  // namespace
}  // namespace symrig::structured::text_rules_test
