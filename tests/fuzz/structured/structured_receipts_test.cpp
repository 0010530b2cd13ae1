// SPDX-License-Identifier: Apache-2.0
// Receipts and board files with other values in them: refused, or drawn and compared as `symrig trace` does.
#include "campaign.hpp"
#include "json_mutator.hpp"
#include "run_once.hpp"
#include "symrig/board/board_file.hpp"
#include "symrig/run/compare.hpp"
#include "symrig/run/run.hpp"
#include "symrig/run/waveform.hpp"

#include <string>
#include <vector>

namespace symrig::structured::structured_receipts_test {
namespace {

void draw(const StoredRun& run) {
  std::vector<Waveform> drawn{waveform(run.plan, run.board, "plan")};
  drawn.push_back(drawn.front());
  drawn.back().edges = run.captured;
  EXPECT_FALSE(vcd_text(drawn).empty());
  EXPECT_FALSE(wavedrom_text(drawn).empty());
}

/// Times since the start, as the CSV of `symrig trace --differences` has them, and the largest difference.
void compare_edges(const StoredRun& run) {
  constexpr double kMost = 2.1 * 200 * 86'400 * 1e9;  // 200 days on either side of the start
  const Comparison all = compare(run.plan, run.captured, run.watched);
  for (const EdgePair& pair : all.pairs) {
    ASSERT_LT(static_cast<std::size_t>(pair.planned.line), run.board.lines.size());
    const double late = static_cast<double>(pair.late()) * 1e9 / static_cast<double>(run.board.rate.hz);
    EXPECT_LT(std::abs(late), kMost);
  }
}

TEST(StructuredReceipts, are_refused_in_one_line_or_drawn) {
  const std::string whole = receipt_json(run_once());
  int refused = 0;
  campaign([&](std::uint64_t number) {
    Random random(number);
    const std::string text = mutate_json(whole, random);
    const auto run = read_receipt(text);
    refused += run.ok() ? 0 : 1;
    if (!run.ok()) {
      EXPECT_EQ(exit_code(run.error().code), 4) << run.error().line();
      return;
    }
    draw(*run);
    compare_edges(*run);
  });
  if (std::getenv("SYMRIG_CASE") == nullptr) {
    EXPECT_GT(refused, 20);
  }
}

TEST(StructuredReceipts, no_board_file_breaks_the_compiler) {
  const RunRecord record = run_once();
  const std::string whole = board_file_text(record.program.board);
  const auto file = parse_program_file(kProgram, "scan.toml", "");
  ASSERT_TRUE(file.ok());
  campaign([&](std::uint64_t number) {
    Random random(number);
    const auto board = parse_board_file(mutate_json(whole, random));
    if (board.ok()) compile_program(*file, *board);
  });
}

}  // namespace
}  // namespace symrig::structured::structured_receipts_test
