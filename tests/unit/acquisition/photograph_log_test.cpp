// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/photograph_log.hpp"

#include "acquisition/fast_crc32c.hpp"
#include "symrig/base/atomic_file.hpp"
#include "symrig/base/random.hpp"
#include "symrig/protocol/crc32c.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <csignal>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;

struct Entry {
  Pattern pattern;
  Radiance photograph;
  ProbeCost spent;
};

/// Floats of every kind: a log must not care.
float any_float(Random& random) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
}

Entry random_entry(Grid grid, int channels, bool binary, std::uint64_t seed) {
  Random random(seed);
  Entry entry{Pattern(grid),
              Radiance{Image<float>(grid, channels), Image<float>(grid, channels),
                       Image<std::uint8_t>(grid, channels)},
              ProbeCost{static_cast<std::int64_t>(seed), 1 - static_cast<std::int64_t>(seed),
                        random.uniform(), random.uniform(), random.uniform()}};
  for (float& v : entry.pattern.values())
    v = binary ? static_cast<float>(random.bits() >> 63U) : any_float(random);
  for (float& v : entry.photograph.mean.values()) v = any_float(random);
  for (float& v : entry.photograph.variance.values()) v = any_float(random);
  for (std::uint8_t& v : entry.photograph.valid.values()) v = static_cast<std::uint8_t>(random.bits() >> 63U);
  return entry;
}

bool same_bits(std::span<const float> a, std::span<const float> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](float x, float y) {
    return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
  });
}

void expect_holds(const PhotographLog& log, std::int64_t k, const Entry& entry) {
  const auto pattern = log.pattern(k);
  const auto photograph = log.photograph(k);
  const auto spent = log.spent(k);
  ASSERT_TRUE(pattern.ok()) << pattern.error().line();
  ASSERT_TRUE(photograph.ok()) << photograph.error().line();
  ASSERT_TRUE(spent.ok()) << spent.error().line();
  EXPECT_EQ(pattern->grid(), entry.pattern.grid());
  EXPECT_TRUE(same_bits(pattern->values(), entry.pattern.values())) << k;
  EXPECT_TRUE(same_bits(photograph->mean.values(), entry.photograph.mean.values())) << k;
  EXPECT_TRUE(same_bits(photograph->variance.values(), entry.photograph.variance.values())) << k;
  EXPECT_EQ(photograph->valid, entry.photograph.valid) << k;
  EXPECT_EQ(spent->photographs, entry.spent.photographs);
  EXPECT_EQ(spent->frames, entry.spent.frames);
  EXPECT_EQ(spent->rig_seconds, entry.spent.rig_seconds);
  EXPECT_EQ(spent->simulate_seconds, entry.spent.simulate_seconds);
  EXPECT_EQ(spent->merge_seconds, entry.spent.merge_seconds);
}

void append(PhotographLog& log, const Entry& entry) {
  const auto done = log.append(entry.pattern, entry.photograph, entry.spent);
  ASSERT_TRUE(done.ok()) << done.error().line();
}

/// Photographs [first, first + count) of `entries` as one run.
void append_run(PhotographLog& log, const std::vector<Entry>& entries, std::size_t first, std::size_t count) {
  std::vector<Pattern> patterns;
  std::vector<Radiance> photographs;
  for (std::size_t k = first; k < first + count; ++k) {
    patterns.push_back(entries[k].pattern);
    photographs.push_back(entries[k].photograph);
  }
  const auto done = log.append_run(patterns, photographs, entries[first].spent);
  ASSERT_TRUE(done.ok()) << done.error().line();
}

class PhotographLogFile : public testing::Test {
 protected:
  PhotographLogFile() {
    std::string name = (fs::temp_directory_path() / "symrig-log-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~PhotographLogFile() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  fs::path path(const char* name = "scene.h5.log") const { return folder_ / name; }
  std::vector<std::byte> bytes() const { return *read_file(path()); }
  void write(std::span<const std::byte> content) const {
    fs::remove(path());  // cutting a file short makes some systems wait for the disk
    std::ofstream(path(), std::ios::binary)
        .write(reinterpret_cast<const char*>(content.data()), std::ssize(content));
  }
  /// Three runs, of two, one and two photographs; where each ends in the file.
  std::vector<std::uint64_t> write_three_runs();

  const LogIdentity identity_{{3, 5}, 2, "sim:plane", "algorithm symrig\n"};
  std::vector<Entry> entries_;
  std::uint64_t head_ = 0;

 private:
  fs::path folder_;
};

std::vector<std::uint64_t> PhotographLogFile::write_three_runs() {
  for (std::uint64_t k = 0; k < 5; ++k)
    entries_.push_back(random_entry(identity_.grid, identity_.channels, k % 2 == 0, k));
  for (const std::size_t k : {1U, 4U}) entries_[k].spent = entries_[k - 1].spent;  // of the run
  std::vector<std::uint64_t> ends;
  auto log = create_photograph_log(path(), identity_);
  EXPECT_TRUE(log.ok());
  head_ = fs::file_size(path());
  for (const auto& [first, count] : {std::pair{0U, 2U}, {2U, 1U}, {3U, 2U}}) {
    append_run(**log, entries_, first, count);
    ends.push_back(fs::file_size(path()));
  }
  return ends;
}

constexpr std::array<std::int64_t, 4> kPhotographsInRuns{0, 2, 3, 5};

TEST(Crc, is_the_protocols) {
  Random random(3);
  std::vector<std::byte> bytes(200);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random.bits() & 0xFFU);
  for (std::size_t size = 0; size <= bytes.size(); ++size) {
    const auto part = std::span(bytes).first(size);
    const std::uint32_t expected =
        protocol::crc32c({reinterpret_cast<const std::uint8_t*>(part.data()), part.size()});
    EXPECT_EQ(acquisition::portable_crc32c(part), expected) << size;
    EXPECT_EQ(acquisition::fast_crc32c(part), expected) << size;
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

// A killed process leaves any beginning of the file.
TEST_F(PhotographLogFile, torn_at_any_byte_it_holds_the_whole_runs_before) {
  const auto ends = write_three_runs();
  const auto whole = bytes();
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    write(std::span(whole).first(size));
    const auto log = open_photograph_log(path(), identity_);
    ASSERT_TRUE(log.ok()) << size << ": " << log.error().line();
    const auto runs =
        static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), size) - ends.begin());
    ASSERT_EQ((*log)->size(), kPhotographsInRuns[runs]) << size;
    EXPECT_EQ(fs::file_size(path()), runs == 0 ? head_ : ends[runs - 1]);
    if (runs == 3) continue;
    append_run(**log, entries_, static_cast<std::size_t>(kPhotographsInRuns[runs]), runs == 1 ? 1 : 2);
    EXPECT_TRUE(std::ranges::equal(bytes(), std::span(whole).first(ends[runs]))) << size;
  }
}

// A disk that lost power may hold anything. CRC-32C finds every change within 32 bits in a row.
TEST_F(PhotographLogFile, changed_at_any_byte_it_holds_the_runs_before_or_says_so) {
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
    const auto run = static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), at) - ends.begin());
    ASSERT_EQ((*log)->size(), kPhotographsInRuns[run]) << at;
    for (std::int64_t k = 0; k < (*log)->size(); ++k)
      expect_holds(**log, k, entries_[static_cast<std::size_t>(k)]);
  }
}

TEST_F(PhotographLogFile, of_another_capture_is_refused_by_the_first_difference) {
  write_three_runs();
  const auto before = bytes();
  const auto refused = [&](LogIdentity other, const std::string& theirs, const std::string& ours) {
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

/// While it lives, no file of this process may grow beyond `bytes`: what a full disk does.
class FullDisk {
 public:
  explicit FullDisk(std::uint64_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    static_cast<void>(std::signal(SIGXFSZ, handler_));
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST_F(PhotographLogFile, a_full_disk_costs_nothing_that_was_logged) {
  const auto ends = write_three_runs();
  const auto whole = bytes();
  // Room for a part of the front, of the first record, of the second record of the last run.
  for (const std::uint64_t room : {ends[1] + 5, ends[1] + 50, ends[2] - 1}) {
    write(std::span(whole).first(ends[1]));
    auto log = open_photograph_log(path(), identity_);
    ASSERT_TRUE(log.ok());
    {
      const FullDisk full(room);
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

TEST_F(PhotographLogFile, no_room_for_the_head_leaves_no_file) {
  const FullDisk full(10);
  EXPECT_EQ(create_photograph_log(path(), identity_).error().code, ErrorCode::io);
  EXPECT_FALSE(fs::exists(path()));
}

}  // namespace
}  // namespace symrig
