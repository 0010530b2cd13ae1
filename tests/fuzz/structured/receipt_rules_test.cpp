// SPDX-License-Identifier: Apache-2.0
// Numbers that a receipt, a board file or a compiled program cannot have.
#include "run_once.hpp"
#include "symrig/board/board_file.hpp"
#include "symrig/program/symprog.hpp"
#include "symrig/protocol/crc32c.hpp"
#include "symrig/protocol/types.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace symrig::structured::receipt_rules_test {
namespace {

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
}  // namespace symrig::structured::receipt_rules_test
