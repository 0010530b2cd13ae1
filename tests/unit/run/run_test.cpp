// SPDX-License-Identifier: Apache-2.0
// Programs on a simulated rig: the real firmware in virtual time.
#include "symrig/run/run.hpp"

#include "symrig/program/compile.hpp"
#include "symrig/run/frame_ledger.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "unit/program/workshop.hpp"

#include <filesystem>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace symrig::run_test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

Result<RunRecord> run_file(const ProgramFile& file, const RunOptions& options = {}) {
  BoardOptions board_options;
  board_options.keep_alive = file.rig.keep_alive;
  SYMRIG_TRY(auto board, Board::connect(make_sim_rig(wiring_of(file.rig)), board_options));
  auto compilation = compile_program(file, board.info());
  if (!compilation.ok()) return Error{ErrorCode::bad_value, compilation.findings.front().text(file.path)};
  return run_program(board, *compilation.program, options);
}

RunRecord ran(std::string_view text, const RunOptions& options = {}) {
  auto record = run_file(test::parse(text), options);
  EXPECT_TRUE(record.ok()) << (record.ok() ? "" : record.error().line());
  return record.ok() ? *std::move(record) : RunRecord{};
}

class Examples : public ::testing::TestWithParam<std::string> {};

// What the host plans from the records and what the board's pins did agree to the tick, edge for edge.
TEST_P(Examples, run_as_planned) {
  const auto file = read_program_file(fs::path(SYMRIG_EXAMPLES) / GetParam());
  ASSERT_OK(file);
  const auto record = run_file(*file);
  ASSERT_OK(record);
  EXPECT_TRUE(record->receipt.clean());
  EXPECT_TRUE(record->differences.exact());
  EXPECT_TRUE(record->plan.complete);
  EXPECT_EQ(record->differences.pairs.size(), record->plan.edges.size());
  EXPECT_GT(record->plan.edges.size(), 20U);
  EXPECT_EQ(record->plan.end - record->plan.start, record->receipt.actual);
  EXPECT_EQ(record->plan.steps, record->receipt.steps);
  EXPECT_EQ(record->plan.marks.size(), record->receipt.marks.size());
  for (std::size_t k = 0; k < record->plan.marks.size(); ++k)
    EXPECT_EQ(record->plan.marks[k].tick, record->receipt.marks[k].tick);
  if (record->program.is_scan) {
    ASSERT_TRUE(record->ledger.has_value());
    EXPECT_TRUE(record->ledger->complete()) << record->ledger->summary();
    EXPECT_EQ(record->ledger->entries().size(), record->program.exposures);
  }
  EXPECT_FALSE(run_error(*record).has_value());
}

std::vector<std::string> example_files() {
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(SYMRIG_EXAMPLES))
    if (entry.path().extension() == ".toml") files.push_back(entry.path().filename().string());
  std::sort(files.begin(), files.end());
  return files;
}

INSTANTIATE_TEST_SUITE_P(All, Examples, ::testing::ValuesIn(example_files()), [](const auto& file) {
  std::string name = file.param.substr(0, file.param.find('.'));
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

constexpr const char* kScan = "symrig = 1\n[program]\npatterns = 20\nbracket = [\"1 ms\", \"2 ms\"]\n";

// The expected duration takes the refresh of the profile; a real run begins anywhere within one.
TEST(Run, takes_as_long_as_expected_within_a_refresh) {
  const RunRecord record = ran(kScan);
  EXPECT_NEAR(seconds(record.receipt.duration()), seconds(record.program.expected), 1.0 / 60);
}

TEST(Run, progress_is_told_and_counts_patterns) {
  std::uint64_t last = 0;
  RunOptions options;
  options.progress = [&last](const RunProgress& at) {
    EXPECT_GE(at.patterns, last);
    EXPECT_EQ(at.patterns_asked, 20U);
    last = at.patterns;
    return true;
  };
  ran(kScan, options);
  EXPECT_GT(last, 10U);
}

TEST(Run, a_caller_who_wants_no_more_aborts_it) {
  RunOptions options;
  options.progress = [](const RunProgress& at) { return at.patterns < 5; };
  const RunRecord record = ran(kScan, options);
  EXPECT_TRUE(record.interrupted);
  EXPECT_EQ(record.receipt.end, RunEnd::aborted);
  EXPECT_FALSE(record.plan.complete);
  EXPECT_EQ(record.differences.largest, 0);
  ASSERT_TRUE(run_error(record).has_value());
  EXPECT_EQ(run_error(record)->code, ErrorCode::interrupted);
}

// Without strobe edges of its own: the projector's vsync is not captured, waits are found by the marks.
TEST(Run, the_plan_follows_the_marks_where_waits_are_not_captured) {
  const RunRecord record =
      ran(std::string("symrig = 1\n[rig.lines.vsync]\nrole = \"vsync\"\ncapture = false\n") +
          std::string(kScan).substr(11));
  EXPECT_TRUE(record.differences.exact());
  EXPECT_EQ(record.plan.end - record.plan.start, record.receipt.actual);
}

// A camera that is slower than the program states misses triggers. The run completes, and is no success.
TEST(Run, frames_that_are_missing_are_an_error) {
  const auto file =
      test::parse("symrig = 1\n[rig.camera]\nreadout = \"2 ms\"\n" + std::string(kScan).substr(11));
  RigWiring wiring = wiring_of(file.rig);
  EXPECT_EQ(wiring.readout, 2ms);
  wiring.readout = 5ms;
  auto board = Board::connect(make_sim_rig(wiring), {});
  ASSERT_OK(board);
  auto compilation = compile_program(file, board->info());
  ASSERT_TRUE(compilation.ok());
  const auto record = run_program(*board, *compilation.program, {});
  ASSERT_OK(record);
  EXPECT_EQ(record->receipt.end, RunEnd::completed);
  ASSERT_TRUE(record->ledger.has_value());
  EXPECT_EQ(record->ledger->missing(), 20U);
  const auto error = run_error(*record);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code, ErrorCode::frame_missing);
  EXPECT_NE(error->what.find("20 missing"), std::string::npos) << error->what;
  const auto json = nlohmann::json::parse(receipt_json(*record));
  EXPECT_FALSE(json.at("clean"));
  EXPECT_EQ(json.at("reason"), error->line());
}

/// A link that ends after a time of the run.
class BreakingLink final : public Link {
 public:
  BreakingLink(std::unique_ptr<Link> link, Nanoseconds lifetime)
      : link_(std::move(link)), lifetime_(lifetime) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override {
    if (dead()) return lost();
    return link_->send(bytes);
  }
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override {
    if (dead()) return lost();
    return link_->receive(timeout);
  }
  Nanoseconds now() const override { return link_->now(); }
  SteadyTime opened() const override { return link_->opened(); }

 private:
  bool dead() const { return now() > lifetime_; }
  static Error lost() { return {ErrorCode::device_lost, "the cable is out", "connect it"}; }

  std::unique_ptr<Link> link_;
  Nanoseconds lifetime_;
};

TEST(Run, what_arrived_before_the_board_was_lost_is_in_the_receipt) {
  const auto file = test::parse(kScan);
  auto link = make_sim_rig(wiring_of(file.rig));
  auto board = Board::connect(std::make_unique<BreakingLink>(std::move(link), 200ms), {});
  ASSERT_OK(board);
  auto compilation = compile_program(file, board->info());
  ASSERT_TRUE(compilation.ok());
  const auto record = run_program(*board, *compilation.program, {});
  ASSERT_OK(record);
  EXPECT_EQ(record->receipt.end, RunEnd::lost);
  EXPECT_GT(record->receipt.marks.size(), 3U);
  EXPECT_LT(record->receipt.marks.size(), 60U);
  EXPECT_TRUE(record->differences.exact());
  const auto error = run_error(*record);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code, ErrorCode::device_lost);
  const auto json = nlohmann::json::parse(receipt_json(*record));
  EXPECT_EQ(json.at("end"), "lost");
  EXPECT_FALSE(json.at("clean"));
  EXPECT_EQ(json.at("counters").at("marks"), record->receipt.marks.size());
  ASSERT_OK(read_receipt(receipt_json(*record)));
}

TEST(Run, a_receipt_that_would_fill_the_memory_is_refused) {
  const auto record =
      run_file(test::parse("symrig = 1\n[program]\npatterns = 1000000\nbracket = [\"1 ms\", \"2 ms\"]\n"));
  ASSERT_FALSE(record.ok());
  EXPECT_EQ(record.error().code, ErrorCode::limit);
  EXPECT_NE(record.error().hint.find("split"), std::string::npos);
}

// The simulated camera is as fast as the program says, so no frame is lost.
TEST(Run, the_simulated_camera_has_the_readout_of_the_program) {
  for (const char* readout : {"500 us", "2 ms", "8 ms"}) {
    const RunRecord record = ran("symrig = 1\n[rig.camera]\nreadout = \"" + std::string(readout) + "\"\n" +
                                 std::string(kScan).substr(11));
    ASSERT_TRUE(record.ledger.has_value());
    EXPECT_TRUE(record.ledger->complete()) << readout << ": " << record.ledger->summary();
    EXPECT_FALSE(run_error(record).has_value());
  }
}

TEST(Run, a_wait_that_runs_out_is_told) {
  const RunRecord record = ran(
      "symrig = 1\n[program]\nsteps = [{ pulse = \"lamp_enable\", width = \"1 us\" }, { hold = \"1 us\" },\n"
      "{ wait = \"camera_strobe\", timeout = \"10 ms\" }, { pulse = \"lamp_enable\", width = \"1 us\" }, { "
      "hold = \"1 us\" }]\n");
  EXPECT_EQ(record.receipt.end, RunEnd::wait_timeout);
  EXPECT_TRUE(record.differences.exact());
  ASSERT_TRUE(run_error(record).has_value());
  EXPECT_EQ(run_error(record)->code, ErrorCode::timeout);
}

TEST(Receipt, tells_of_a_run_and_can_be_read_back) {
  const RunRecord record = ran(kScan);
  const std::string text = receipt_json(record);
  const auto json = nlohmann::json::parse(text);
  for (const char* key :
       {"format", "version", "end", "clean", "interrupted", "reason", "fault", "hashes", "board", "time",
        "clock", "counters", "differences", "ledger", "lines", "planned", "captured"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_EQ(json["end"], "completed");
  EXPECT_EQ(json["differences"]["exact"], true);
  EXPECT_EQ(json["ledger"]["summary"], "40 frames for 40 exposures");
  EXPECT_EQ(json["counters"]["steps"], record.receipt.steps);
  const auto run = read_receipt(text);
  ASSERT_OK(run);
  EXPECT_TRUE(run->whole);
  EXPECT_EQ(run->captured, record.receipt.edges);
  ASSERT_EQ(run->plan.edges.size(), record.plan.edges.size());
  EXPECT_TRUE(compare(run->plan, run->captured, run->watched).exact());
}

TEST(Receipt, lists_are_bounded_and_counts_stand_for_the_rest) {
  const RunRecord record = ran(kScan);
  const auto json = nlohmann::json::parse(receipt_json(record, 10));
  EXPECT_EQ(json["captured"]["listed"], 10);
  EXPECT_EQ(json["captured"]["count"], record.receipt.edges.size());
  EXPECT_FALSE(read_receipt(receipt_json(record, 10))->whole);
  for (const auto& line : json["lines"]) {
    if (line["line"] != "camera_trigger") continue;
    EXPECT_EQ(line["captured"]["edges"], 80);
    EXPECT_EQ(line["captured"]["high_ns"], (std::vector<std::int64_t>{1'000'000, 2'000'000}));
  }
}

TEST(Receipt, what_is_none_is_refused) {
  for (const char* text :
       {"", "{}", "[]", R"({"format":"symrig-receipt"})", R"({"format":"symrig-receipt","version":2})"})
    EXPECT_FALSE(read_receipt(text).ok()) << text;
  std::string text = receipt_json(ran(kScan));
  text.replace(text.find(R"("captured":{"count")"), 10, R"("recaptured")");
  EXPECT_FALSE(read_receipt(text).ok());
}

}  // namespace
}  // namespace symrig::run_test

namespace symrig::frame_ledger_test {
namespace {

/// Two photographs of two exposures, marks at 0, 100, 200, 300, 400, 500.
std::vector<StepMark> marks() {
  return {{0, 0, {0}}, {1, 1, {100}}, {2, 2, {200}}, {0, 3, {300}}, {1, 4, {400}}, {2, 5, {500}}};
}

std::vector<FrameStamp> frames_at(const std::vector<std::uint64_t>& ticks) {
  std::vector<FrameStamp> frames;
  frames.reserve(ticks.size());
  for (const std::uint64_t tick : ticks) frames.push_back({frames.size(), {tick}});
  return frames;
}

TEST(FrameLedger, each_frame_finds_its_exposure) {
  const auto ledger = FrameLedger::pair(marks(), frames_at({101, 200, 409, 510}), Ticks{10});
  ASSERT_TRUE(ledger.ok());
  EXPECT_TRUE(ledger->complete());
  ASSERT_EQ(ledger->entries().size(), 4U);
  EXPECT_EQ(ledger->entries()[0].delay.count, 1U);
  EXPECT_EQ(ledger->entries()[2].photograph, 1U);
  EXPECT_EQ(ledger->entries()[2].exposure, 0U);
  EXPECT_EQ(ledger->entries()[2].frame, 2U);
  EXPECT_EQ(ledger->summary(), "4 frames for 4 exposures");
}

TEST(FrameLedger, a_lost_frame_does_not_shift_those_after_it) {
  const auto ledger = FrameLedger::pair(marks(), frames_at({101, 401, 501}), Ticks{10});
  ASSERT_TRUE(ledger.ok());
  EXPECT_EQ(ledger->missing(), 1U);
  EXPECT_FALSE(ledger->entries()[1].frame.has_value());
  EXPECT_EQ(ledger->entries()[2].frame, 1U);
  EXPECT_EQ(ledger->summary(), "3 frames for 4 exposures; 1 missing, the first at photograph 0, exposure 1");
}

TEST(FrameLedger, frames_nobody_asked_for_are_named) {
  const auto ledger = FrameLedger::pair(marks(), frames_at({50, 101, 105, 200, 350, 401, 501}), Ticks{10});
  ASSERT_TRUE(ledger.ok());
  EXPECT_EQ(ledger->missing(), 0U);
  const std::vector<std::size_t> expected{0, 2, 4};  // too early, a second one, too late
  EXPECT_EQ(std::vector<std::size_t>(ledger->unasked().begin(), ledger->unasked().end()), expected);
  EXPECT_FALSE(ledger->complete());
}

TEST(FrameLedger, what_is_out_of_order_is_refused) {
  EXPECT_FALSE(FrameLedger::pair(marks(), frames_at({200, 100}), Ticks{10}).ok());
  std::vector<StepMark> wrong = marks();
  std::swap(wrong[1], wrong[4]);
  EXPECT_FALSE(FrameLedger::pair(wrong, frames_at({101}), Ticks{10}).ok());
}

}  // namespace
}  // namespace symrig::frame_ledger_test
