// SPDX-License-Identifier: Apache-2.0
// What a kill, a loss of power and a full disk leave of a log.
#include "full_disk.hpp"
#include "log_file.hpp"
#include "symrig/acquisition/photograph_log.hpp"

namespace symrig::broken_log_test {
namespace {

using namespace tests;  // NOLINT(google-build-using-namespace): the fixture and its helpers
using BrokenLog = PhotographLogFile;

// A killed process leaves any beginning of the file.
TEST_F(BrokenLog, torn_at_any_byte_it_holds_the_whole_runs_before) {
  const auto ends = write_three_runs();
  const auto whole = bytes();
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    write(std::span(whole).first(size));
    const auto log = open_photograph_log(path(), identity_);
    ASSERT_TRUE(log.ok()) << size << ": " << log.error().line();
    const auto runs =
        static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), size) - ends.begin());
    ASSERT_EQ((*log)->size(), kPhotographsInRuns[runs]) << size;
    EXPECT_EQ(fs::file_size(path()), size) << "opening changes nothing";
    if (runs == 3) continue;
    append_run(**log, entries_, static_cast<std::size_t>(kPhotographsInRuns[runs]), runs == 1 ? 1 : 2);
    EXPECT_TRUE(std::ranges::equal(bytes(), std::span(whole).first(ends[runs]))) << size;
  }
}

// A disk that lost power may hold anything. CRC-32C finds every change within 32 bits in a row.
TEST_F(BrokenLog, changed_at_any_byte_it_holds_the_runs_before_or_says_so) {
  const auto ends = write_three_runs();
  const auto whole = bytes();
  for (std::size_t at = 0; at < whole.size(); ++at) {
    auto changed = whole;
    changed[at] ^= std::byte{0x10};
    write(changed);
    const auto log = open_photograph_log(path(), identity_);
    if (at < head_) {
      const bool in_padding = log.ok() && (*log)->size() == 5;
      EXPECT_TRUE(in_padding || log.error().code == ErrorCode::bad_format) << at;
      continue;
    }
    ASSERT_TRUE(log.ok()) << at << ": " << log.error().line();
    const std::size_t run = std::upper_bound(ends.begin(), ends.end(), at) - ends.begin();
    ASSERT_EQ((*log)->size(), kPhotographsInRuns[run]) << at;
    for (std::int64_t k = 0; k < (*log)->size(); ++k) expect_holds(**log, k, entries_[k]);
  }
}

TEST_F(BrokenLog, a_full_disk_costs_nothing_that_was_logged) {
  const auto ends = write_three_runs();
  const auto whole = bytes();
  // Room for a part of the front, of the first record, of the second record of the last run.
  for (const std::uint64_t room : {ends[1] + 5, ends[1] + 50, ends[2] - 1}) {
    write(std::span(whole).first(ends[1]));
    auto log = open_photograph_log(path(), identity_);
    ASSERT_TRUE(log.ok());
    {
      const test::FullDisk full(room);
      const std::vector<Pattern> patterns{entries_[3].pattern, entries_[4].pattern};
      const std::vector<Radiance> photographs{entries_[3].photograph, entries_[4].photograph};
      const auto failed = (*log)->append_run(patterns, photographs, {});
      ASSERT_FALSE(failed.ok());
      EXPECT_EQ(failed.error().code, ErrorCode::io) << failed.error().line();
    }
    EXPECT_EQ((*log)->size(), 3);
    EXPECT_EQ(fs::file_size(path()), ends[1]);
    append_run(**log, entries_, 3, 2);  // somebody made room
    EXPECT_EQ(bytes(), whole);
  }
}

TEST_F(BrokenLog, no_room_for_the_head_leaves_no_file) {
  const test::FullDisk full(10);
  EXPECT_EQ(create_photograph_log(path(), identity_).error().code, ErrorCode::io);
  EXPECT_FALSE(fs::exists(path()));
}

}  // namespace
}  // namespace symrig::broken_log_test
