// SPDX-License-Identifier: Apache-2.0
// Compiled programs with other values in header and records, their checksums made right again: refused, or
// linted, drawn and run on the simulated board.
// Receipts and board files with other values in them: refused, or drawn and compared as `symrig trace` does.
#include "campaign.hpp"
#include "mutators.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/protocol/crc32c.hpp"
#include "symrig/protocol/types.hpp"
#include "symrig/run/compare.hpp"
#include "symrig/run/run.hpp"
#include "symrig/run/waveform.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::structured::structured_programs_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kHead = 24;

/// A compiled program taken apart.
struct Parts {
  std::string header;
  Bytes records;

  explicit Parts(const Bytes& file) {
    const std::size_t size = protocol::get_u32(file.data() + 12);
    header.assign(file.begin() + kHead, file.begin() + kHead + static_cast<std::ptrdiff_t>(size));
    records.assign(file.begin() + kHead + static_cast<std::ptrdiff_t>(size), file.end());
  }

  Bytes joined(std::uint32_t version = 1) const {
    Bytes file(kHead + header.size() + records.size());
    std::copy_n("SYMPROG\n", 8, file.begin());
    std::copy(header.begin(), header.end(), file.begin() + kHead);
    std::copy(records.begin(), records.end(), file.end() - std::ssize(records));
    protocol::put_u32(file.data() + 8, version);
    protocol::put_u32(file.data() + 12, static_cast<std::uint32_t>(header.size()));
    protocol::put_u32(file.data() + 16, static_cast<std::uint32_t>(records.size()));
    protocol::put_u32(file.data() + 20, protocol::crc32c({file.data() + kHead, file.size() - kHead}));
    return file;
  }
};

/// Other words in the records; the header names their hash.
void mutate_records(Parts& parts, Random& random) {
  for (std::uint64_t k = 1 + below(random, 3); k > 0 && parts.records.size() >= 8; --k) {
    const auto at = static_cast<std::size_t>(below(random, parts.records.size() / 4)) * 4;
    const auto old = static_cast<std::int64_t>(protocol::get_u32(parts.records.data() + at));
    protocol::put_u32(parts.records.data() + at, static_cast<std::uint32_t>(other_integer(random, old)));
  }
  if (below(random, 8) == 0) parts.records.resize(parts.records.size() / 8 * 8 - 8);
  auto json = nlohmann::ordered_json::parse(parts.header);
  json["program_hash"] =
      fmt::format("{:08x}", protocol::crc32c({parts.records.data(), parts.records.size()}));
  json["places"].get_ref<nlohmann::ordered_json::array_t&>().resize(parts.records.size() / 8, 0);
  parts.header = json.dump();
}

/// As `lint`, `trace` and `run` do. A program may be long; its time is the simulated board's.
void use(const CompiledProgram& program) {
  lint(program.program, program.board, program.lines);
  TimelineOptions options;
  options.max_edges = 5'000;
  const auto plan = expand(program.program, program.board, options);
  if (plan.ok()) {
    const std::vector<Waveform> drawn{waveform(*plan, program.board, "plan")};
    vcd_text(drawn);
    wavedrom_text(drawn);
  }
  auto board = Board::connect(make_sim_rig(program.wiring));
  ASSERT_TRUE(board.ok());
  RunOptions run;
  int looks = 0;
  run.progress = [&looks](const RunProgress&) { return ++looks < 20; };
  const auto record = run_program(*board, program, run);
  if (record.ok()) {
    EXPECT_FALSE(receipt_json(*record).empty());
  }
}

TEST(StructuredPrograms, are_refused_in_one_line_or_run) {
  const Bytes whole = symprog_bytes(run_once().program);
  ASSERT_EQ(Parts(whole).joined(), whole);
  int refused = 0;
  campaign([&](std::uint64_t number) {
    Random random(number);
    Parts parts(whole);
    if (number % 2 == 0)
      parts.header = mutate_text(parts.header, random);
    else
      mutate_records(parts, random);
    const auto program = read_symprog(parts.joined());
    refused += program.ok() ? 0 : 1;
    if (!program.ok()) {
      EXPECT_EQ(exit_code(program.error().code), 4) << program.error().line();
    } else {
      use(*program);
    }
  });
  if (std::getenv("SYMRIG_CASE") == nullptr) {
    EXPECT_GT(refused, 20);
  }
}

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
}  // namespace symrig::structured::structured_programs_test
