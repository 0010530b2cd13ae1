// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/photograph_log.hpp"

#include "log_file.hpp"
#include "symrig/acquisition/internal/fast_crc32c.hpp"
#include "symrig/protocol/crc32c.hpp"

#include <thread>

namespace symrig::photograph_log_test {
namespace {

using namespace tests;  // NOLINT(google-build-using-namespace): the fixture and its helpers

void expect_the_protocols(std::span<const std::byte> part) {
  const std::uint32_t expected =
      protocol::crc32c({reinterpret_cast<const std::uint8_t*>(part.data()), part.size()});
  EXPECT_EQ(acquisition::portable_crc32c(part), expected) << part.size();
  EXPECT_EQ(acquisition::fast_crc32c(part), expected) << part.size();
}

/// Both take eight bytes at a time: every length and every offset to a multiple of eight, and long ones.
TEST(Crc, is_the_protocols) {
  Random random(3);
  std::vector<std::byte> bytes(100'000);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random.bits() & 0xFFU);
  for (std::size_t offset = 0; offset < 16; ++offset) {
    for (std::size_t size = 0; size <= 200; ++size)
      expect_the_protocols(std::span(bytes).subspan(offset, size));
    expect_the_protocols(std::span(bytes).subspan(offset));
    expect_the_protocols(std::span(bytes).subspan(offset, bytes.size() - 16 - offset));
  }
}

TEST_F(PhotographLogFile, gives_back_every_bit_of_any_size_from_memory_and_from_a_file) {
  for (const Grid grid : {Grid{1, 1}, Grid{1, 2}, Grid{3, 1}, Grid{7, 5}, Grid{16, 16}})
    for (const int channels : {1, 3}) {
      const auto memory = make_memory_log(grid, channels);
      fs::remove(path());
      auto file = create_photograph_log(path(), {grid, channels, "a rig", ""});
      ASSERT_TRUE(file.ok()) << file.error().line();
      for (PhotographLog* log : {memory.get(), file->get()}) {
        EXPECT_EQ(log->grid(), grid);
        EXPECT_EQ(log->channels(), channels);
        EXPECT_EQ(log->size(), 0);
        for (std::uint64_t k = 0; k < 4; ++k) append(*log, random_entry(grid, channels, k % 2 == 0, k));
        ASSERT_EQ(log->size(), 4);
        for (std::uint64_t k = 0; k < 4; ++k)
          expect_holds(*log, static_cast<std::int64_t>(k), random_entry(grid, channels, k % 2 == 0, k));
      }
    }
}

TEST_F(PhotographLogFile, minus_zero_is_no_binary_pattern) {
  Entry entry = random_entry({2, 2}, 1, true, 1);
  entry.pattern.at(1, 0) = -0.F;
  const auto log = make_memory_log({2, 2}, 1);
  append(*log, entry);
  expect_holds(*log, 0, entry);
}

TEST_F(PhotographLogFile, many_threads_may_read) {
  write_three_runs();
  const auto log = open_photograph_log(path(), identity_);
  ASSERT_TRUE(log.ok());
  std::vector<std::thread> threads;
  threads.reserve(4);
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (std::size_t k = 0; k < 100; ++k)
        expect_holds(**log, static_cast<std::int64_t>(k % 5), entries_[k % 5]);
    });
  for (std::thread& thread : threads) thread.join();
}

TEST_F(PhotographLogFile, opened_again_it_holds_the_same_and_takes_more) {
  write_three_runs();
  {
    const auto log = open_photograph_log(path(), identity_);
    ASSERT_TRUE(log.ok()) << log.error().line();
    append(**log, entries_[1]);
  }
  const auto log = open_photograph_log(path(), identity_);
  ASSERT_TRUE(log.ok());
  ASSERT_EQ((*log)->size(), 6);
  for (std::size_t k = 0; k < 5; ++k) expect_holds(**log, static_cast<std::int64_t>(k), entries_[k]);
  expect_holds(**log, 5, entries_[1]);
}

TEST_F(PhotographLogFile, of_another_capture_is_refused_by_the_first_difference) {
  write_three_runs();
  const auto before = bytes();
  const auto refused = [&](const LogIdentity& other, const std::string& theirs, const std::string& ours) {
    const auto log = open_photograph_log(path(), other);
    ASSERT_FALSE(log.ok());
    EXPECT_EQ(log.error().code, ErrorCode::bad_format);
    EXPECT_NE(log.error().what.find("it has '" + theirs + "', this one '" + ours + "'"), std::string::npos)
        << log.error().line();
  };
  LogIdentity other = identity_;
  other.grid = {5, 3};
  refused(other, "grid 3x5", "grid 5x3");
  other = identity_;
  other.channels = 1;
  refused(other, "channels 2", "channels 1");
  other = identity_;
  other.rig = "sim:gummy";
  refused(other, "rig sim:plane", "rig sim:gummy");
  other = identity_;
  other.options = "algorithm paper\n";
  refused(other, "algorithm symrig", "algorithm paper");
  EXPECT_EQ(bytes(), before);
}

TEST_F(PhotographLogFile, what_is_no_log_is_refused_and_left_alone) {
  const std::string text = "what somebody else wrote into a file of this name, which is long enough";
  for (const std::string& content : {text, std::string("short")}) {
    write(std::as_bytes(std::span(content)));
    const auto log = open_photograph_log(path(), identity_);
    ASSERT_FALSE(log.ok());
    EXPECT_EQ(log.error().code, ErrorCode::bad_format);
    EXPECT_TRUE(std::ranges::equal(bytes(), std::as_bytes(std::span(content))));
  }
}

TEST_F(PhotographLogFile, is_never_overwritten_or_shared) {
  const auto log = create_photograph_log(path(), identity_);
  ASSERT_TRUE(log.ok());
  EXPECT_EQ(create_photograph_log(path(), identity_).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(open_photograph_log(path(), identity_).error().code, ErrorCode::io);  // somebody writes to it
  EXPECT_EQ(open_photograph_log(path("none.log"), identity_).error().code, ErrorCode::not_found);
  EXPECT_EQ(create_photograph_log(path("none/scene.log"), identity_).error().code, ErrorCode::not_found);
}

TEST_F(PhotographLogFile, many_processes_may_read_one_but_not_while_a_capture_writes) {
  write_three_runs();
  const auto before = bytes();
  {
    const auto one = read_photograph_log(path()), other = read_photograph_log(path());
    ASSERT_TRUE(one.ok()) << one.error().line();
    ASSERT_TRUE(other.ok()) << other.error().line();
    for (const auto* log : {&*one, &*other}) {
      EXPECT_EQ((*log)->grid(), identity_.grid);
      EXPECT_EQ((*log)->channels(), identity_.channels);
      ASSERT_EQ((*log)->size(), 5);
      for (std::size_t k = 0; k < 5; ++k) expect_holds(**log, static_cast<std::int64_t>(k), entries_[k]);
    }
    const auto writer = open_photograph_log(path(), identity_);
    ASSERT_FALSE(writer.ok());
    EXPECT_NE(writer.error().what.find("another process has it open"), std::string::npos)
        << writer.error().line();
  }
  const auto writer = open_photograph_log(path(), identity_);
  ASSERT_TRUE(writer.ok()) << writer.error().line();
  const auto reader = read_photograph_log(path());
  ASSERT_FALSE(reader.ok());
  EXPECT_EQ(reader.error().code, ErrorCode::io);
  EXPECT_NE(reader.error().what.find("another process is writing to it"), std::string::npos)
      << reader.error().line();
  EXPECT_EQ(bytes(), before);
}

TEST_F(PhotographLogFile, reading_leaves_out_a_run_that_is_torn_and_keeps_the_file) {
  const std::vector<std::uint64_t> ends = write_three_runs();
  fs::resize_file(path(), ends[2] - 1);
  const auto before = bytes();
  const auto log = read_photograph_log(path());
  ASSERT_TRUE(log.ok()) << log.error().line();
  EXPECT_EQ((*log)->size(), 3);
  EXPECT_EQ(bytes(), before);
}

TEST_F(PhotographLogFile, what_is_no_log_cannot_be_read) {
  EXPECT_EQ(read_photograph_log(path("none.log")).error().code, ErrorCode::not_found);
  write_three_runs();
  const std::vector<std::byte> sound = bytes();
  const auto refused = [&](std::span<const std::byte> content) {
    write(content);
    const auto log = read_photograph_log(path());
    ASSERT_FALSE(log.ok());
    EXPECT_EQ(log.error().code, ErrorCode::bad_format);
    EXPECT_NE(log.error().hint.find("--keep-log"), std::string::npos) << log.error().line();
  };
  refused({});
  refused(std::span(sound).first(head_ - 9));  // its writer was killed at the head
  for (const std::size_t at : {0U, 8U, 12U, 16U, 24U, 30U}) {
    std::vector<std::byte> wrong = sound;
    wrong[at] ^= std::byte{0x40};
    refused(wrong);
  }
}

TEST_F(PhotographLogFile, wrong_sizes_and_numbers_are_errors) {
  const auto file = create_photograph_log(path(), identity_);
  const auto memory = make_memory_log(identity_.grid, identity_.channels);
  for (PhotographLog* log : {file->get(), memory.get()}) {
    for (const auto& [grid, channels] : {std::pair{Grid{5, 3}, 2}, std::pair{Grid{3, 5}, 1}}) {
      const Entry entry = random_entry(grid, channels, true, 1);
      EXPECT_EQ(log->append(entry.pattern, entry.photograph, {}).error().code, ErrorCode::size_mismatch);
    }
    const Pattern pattern(identity_.grid);
    EXPECT_EQ(log->append_run({&pattern, 1}, {}, {}).error().code, ErrorCode::size_mismatch);
    EXPECT_EQ(log->size(), 0);
    for (const std::int64_t k : {-1, 0}) {
      EXPECT_EQ(log->pattern(k).error().code, ErrorCode::bad_argument);
      EXPECT_EQ(log->photograph(k).error().code, ErrorCode::bad_argument);
      EXPECT_EQ(log->spent(k).error().code, ErrorCode::bad_argument);
    }
  }
}

// A capture with another budget of seconds wants other exposures of the same pattern.
TEST_F(PhotographLogFile, keeps_by_how_much_a_budget_raised_the_noise) {
  LogIdentity budgeted = identity_;
  budgeted.budget = {.photographs = 0, .rig_seconds = 12, .any = true};
  entries_.push_back(random_entry(identity_.grid, identity_.channels, true, 1));
  {
    const auto log = *create_photograph_log(path(), budgeted);
    for (const std::int32_t steps : {0, 3, 11}) {
      log->note_coarser(steps);
      append(*log, entries_[0]);
    }
  }
  const auto log = *open_photograph_log(path(), budgeted);
  ASSERT_EQ(log->size(), 3);
  EXPECT_EQ(log->coarser(0), 0);
  EXPECT_EQ(log->coarser(1), 3);
  EXPECT_EQ(log->coarser(2), 11);
  EXPECT_TRUE(log->budgeted(2));
  expect_holds(*log, 2, entries_[0]);
}

}  // namespace
}  // namespace symrig::photograph_log_test
