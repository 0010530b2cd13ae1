// SPDX-License-Identifier: Apache-2.0
// A build for a board with little memory keeps 12 lines and 6 outputs. Programs may still name any line of
// the wire: the check must refuse those, and must not read beyond the lines that it keeps.
#include "symrig/protocol/check_program.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace symrig::protocol::small_board_test {
namespace {

static_assert(kMaxLines == 12 && kMaxOutputs == 6,
              "this program is compiled with the bounds of a small board");

std::vector<Violation> findings(const std::vector<Record>& records) {
  BoardConfig config;
  for (unsigned k = 0; k < kMaxLines; ++k) {
    config.lines[k].configured = true;
    config.lines[k].output = k < kMaxOutputs;
  }
  ProgramRules rules;
  rules.config = &config;
  rules.max_bytes = 512;
  std::vector<std::uint8_t> bytes(records.size() * kRecordSize);
  for (std::size_t k = 0; k < records.size(); ++k) put_record(records[k], bytes.data() + k * kRecordSize);
  std::vector<Violation> found;
  ProgramTiming timing;
  check_program({{bytes.data(), bytes.size()}}, rules, timing, [&](const Violation& violation) {
    found.push_back(violation);
    return true;
  });
  return found;
}

TEST(SmallBoard, takes_a_program_of_its_own_lines) {
  EXPECT_TRUE(findings({make_record(Op::set_word, 0x3F, 100), make_wait({11, WaitFor::rising, false}, 100),
                        make_record(Op::end, 0, 0)})
                  .empty());
}

TEST(SmallBoard, refuses_levels_of_each_line_that_it_does_not_keep) {
  for (unsigned line = kMaxOutputs; line < kWordOutputs; ++line) {
    const auto found =
        findings({make_record(Op::set_word, uint32_t{1} << line, 100), make_record(Op::end, 0, 0)});
    ASSERT_EQ(found.size(), 1U) << line;
    EXPECT_EQ(found[0].rule, Rule::not_an_output);
    EXPECT_EQ(found[0].line, line);
    EXPECT_FALSE(findings({make_record(Op::end, uint32_t{1} << line, 0)}).empty()) << line;
  }
}

TEST(SmallBoard, refuses_waits_on_each_line_that_it_does_not_keep) {
  for (unsigned line = kMaxLines; line < kWordLines; ++line) {
    const auto found = findings({make_wait({static_cast<std::uint8_t>(line), WaitFor::both, false}, 100),
                                 make_record(Op::end, 0, 0)});
    ASSERT_EQ(found.size(), 1U) << line;
    EXPECT_EQ(found[0].rule, Rule::not_an_input);
    EXPECT_EQ(found[0].line, line);
  }
}

}  // namespace
}  // namespace symrig::protocol::small_board_test
