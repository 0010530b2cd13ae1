// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/photograph_log.hpp"

#include "broken_off.hpp"
#include "dense_scene.hpp"
#include "full_disk.hpp"
#include "log_file.hpp"
#include "symrig/acquisition/internal/fast_crc32c.hpp"
#include "symrig/protocol/crc32c.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <thread>

#include <gtest/gtest.h>

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

// What a camera with pixels of its own saw: rounded to its steps, and read by strips as a whole.
TEST_F(PhotographLogFile, rounds_the_photographs_of_a_camera_to_its_steps) {
  const Grid camera{70, 5};  // strips of 32, 32 and 6 rows
  const int channels = 2;
  identity_.steps = some_steps(camera, channels);
  Random random(4);
  Entry entry = random_entry(identity_.grid, channels, true, 1, camera);
  const auto steps = identity_.steps->values();
  for (std::size_t i = 0; i < steps.size(); ++i) {
    entry.photograph.mean.values()[i] = static_cast<float>((random.uniform() * 60000 - 10000) * steps[i]);
    entry.photograph.variance.values()[i] =
        static_cast<float>(std::exp(-15 * random.uniform())) * steps[i] * steps[i] * 1e6F;
  }
  entry.photograph.mean.values()[3] = 60000 * steps[3];   // brighter than its codes
  entry.photograph.mean.values()[4] = -20000 * steps[4];  // darker
  entry.photograph.variance.values()[5] = std::numeric_limits<float>::quiet_NaN();
  for (const std::size_t i : {3U, 4U, 5U}) entry.photograph.valid.values()[i] = 1;
  {
    const auto log = *create_photograph_log(path(), identity_);
    append(*log, entry);
    append(*log, entry);
  }
  EXPECT_TRUE(*keeps_camera_photographs(path()));
  entries_ = {entry};
  const auto expect_both = [&](const PhotographLog& log) {
    ASSERT_EQ(log.size(), 2);
    EXPECT_EQ(log.camera_grid(), camera);
    EXPECT_EQ(log.grid(), identity_.grid);
    expect_holds(log, 1, PhotographLogFile::kept(log, 0));
  };
  expect_both(**read_photograph_log(path()));
  const auto log = *open_photograph_log(path(), identity_);
  expect_both(*log);
  const Radiance kept = *log->photograph(0);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const bool lost = i == 3 || i == 4 || i == 5 || entry.photograph.valid.values()[i] == 0;
    ASSERT_EQ(kept.valid.values()[i], lost ? 0 : 1) << i;
    if (lost) {
      EXPECT_EQ(kept.mean.values()[i], 0);
      EXPECT_EQ(kept.variance.values()[i], 0);
      continue;
    }
    const double mean = entry.photograph.mean.values()[i];
    EXPECT_NEAR(kept.mean.values()[i], mean, 0.5 * steps[i] + 1e-6 * std::abs(mean)) << i;
    const double variance = entry.photograph.variance.values()[i] + steps[i] * steps[i] / 12;
    EXPECT_NEAR(kept.variance.values()[i], variance, variance / 16 * 1.001) << i;  // half of an eighth
  }
  Radiance strip;
  for (int s = 0; s < 3; ++s) {
    ASSERT_TRUE(log->rows(1, s, strip).ok());
    ASSERT_EQ(strip.mean.grid(), (Grid{s < 2 ? 32 : 6, 5}));
    for (int c = 0; c < channels; ++c)
      for (int row = 0; row < strip.mean.grid().rows; ++row)
        for (int col = 0; col < 5; ++col) {
          ASSERT_EQ(strip.mean.at(row, col, c), kept.mean.at(32 * s + row, col, c));
          ASSERT_EQ(strip.variance.at(row, col, c), kept.variance.at(32 * s + row, col, c));
          ASSERT_EQ(strip.valid.at(row, col, c), kept.valid.at(32 * s + row, col, c));
        }
  }
  // Three bytes a sample.
  EXPECT_LE(fs::file_size(path()), 2 * (3 * steps.size() + 200) + 4 * steps.size() + 400);
}

TEST_F(PhotographLogFile, of_a_camera_is_refused_by_a_capture_of_cells) {
  LogIdentity of_camera = identity_;
  of_camera.steps = some_steps({9, 9}, 2);
  { ASSERT_TRUE(create_photograph_log(path(), of_camera).ok()); }
  EXPECT_EQ(open_photograph_log(path(), identity_).error().code, ErrorCode::bad_format);
  LogIdentity other = identity_;
  other.steps = some_steps({9, 8}, 2);
  EXPECT_NE(open_photograph_log(path(), other).error().line().find("camera 9x9"), std::string::npos);
  fs::remove(path());
  { ASSERT_TRUE(create_photograph_log(path(), identity_).ok()); }
  EXPECT_FALSE(*keeps_camera_photographs(path()));
  EXPECT_EQ(open_photograph_log(path(), of_camera).error().code, ErrorCode::bad_format);
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
      log->note_budget(steps);
      append(*log, entries_[0]);
    }
  }
  const auto log = *open_photograph_log(path(), budgeted);
  ASSERT_EQ(log->size(), 3);
  EXPECT_EQ(log->budget_note(0), 0);
  EXPECT_EQ(log->budget_note(1), 3);
  EXPECT_EQ(log->budget_note(2), 11);
  EXPECT_TRUE(log->budgeted(2));
  expect_holds(*log, 2, entries_[0]);
}

}  // namespace

}  // namespace symrig::photograph_log_test

namespace symrig::broken_log_test {

// What a kill, a loss of power and a full disk leave of a log.

namespace {

using namespace tests;  // NOLINT(google-build-using-namespace): the fixture and its helpers

/// A log of cells, or of a camera's own photographs, which have two strips.
class BrokenLog : public PhotographLogFile, public testing::WithParamInterface<bool> {
 protected:
  BrokenLog() {
    if (GetParam()) identity_.steps = some_steps({34, 2}, identity_.channels);
  }
};
INSTANTIATE_TEST_SUITE_P(Of, BrokenLog, testing::Bool(),
                         [](const auto& of) { return std::string(of.param ? "Camera" : "Cells"); });

// A killed process leaves any beginning of the file.
TEST_P(BrokenLog, torn_at_any_byte_it_holds_the_whole_runs_before) {
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
TEST_P(BrokenLog, changed_at_any_byte_it_holds_the_runs_before_or_says_so) {
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
    for (std::int64_t k = 0; k < (*log)->size(); ++k) expect_holds(**log, k, kept(**log, k));
  }
}

TEST_P(BrokenLog, a_full_disk_costs_nothing_that_was_logged) {
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

TEST_P(BrokenLog, no_room_for_the_head_leaves_no_file) {
  const test::FullDisk full(10);
  EXPECT_EQ(create_photograph_log(path(), identity_).error().code, ErrorCode::io);
  EXPECT_FALSE(fs::exists(path()));
}

}  // namespace

}  // namespace symrig::broken_log_test

namespace symrig::logged_probe_test {
namespace {

using tests::PhotographLogFile, tests::same_bits, tests::some_steps;

using tests::DenseProbe;
using tests::DenseTransport;
using tests::expect_same;
using tests::facing_planes;
using tests::FailingProbe;
using tests::kNever;

std::vector<Pattern> some_patterns(Grid grid, std::size_t count) {
  std::vector<Pattern> patterns;
  for (std::size_t k = 0; k < count; ++k) {
    patterns.emplace_back(grid);
    patterns.back().values()[k % patterns.back().values().size()] = 1;
  }
  return patterns;
}

TEST(LoggedProbe, logs_what_it_passes_on) {
  const DenseTransport scene = facing_planes({6, 5});
  DenseProbe dense(scene, 0.01);
  DenseProbe twin(scene, 0.01);
  const auto log = make_memory_log(dense.grid(), 1);
  LoggedProbe probe(dense, *log);
  const auto patterns = some_patterns({6, 5}, 7);
  const auto answers = probe.measure(patterns);
  const auto expected = twin.measure(patterns);
  ASSERT_TRUE(answers.ok()) << answers.error().line();
  ASSERT_EQ(answers->size(), 7U);
  ASSERT_EQ(log->size(), 7);
  EXPECT_EQ(probe.replayed(), 0);
  expect_same(probe.cost(), dense.cost());
  for (std::size_t k = 0; k < 7; ++k) {
    EXPECT_EQ((*answers)[k].mean, (*expected)[k].mean);
    EXPECT_EQ(log->photograph(static_cast<std::int64_t>(k))->mean, (*expected)[k].mean);
    EXPECT_EQ(*log->pattern(static_cast<std::int64_t>(k)), patterns[k]);
    EXPECT_EQ(log->spent(static_cast<std::int64_t>(k))->photographs, static_cast<std::int64_t>(k) + 1);
  }
}

// A scene file holds numbers below 2^60; the log stays as it was.
TEST(LoggedProbe, refuses_light_that_no_scene_file_holds) {
  for (const double scale : {0x1p59, 0x1p61}) {
    const tests::DenseTransport scene({4, 4}, [scale](int i, int j) { return i == j ? scale : 0; });
    tests::DenseProbe rig(scene);
    const auto log = make_memory_log(scene.grid(), 1);
    LoggedProbe logged(rig, *log);
    const Pattern pattern(scene.grid(), 1, 1.F);
    const auto seen = logged.measure({&pattern, 1});
    EXPECT_EQ(seen.ok(), scale < 0x1p60);
    EXPECT_TRUE(seen.ok() || seen.error().code == ErrorCode::bad_value);
    EXPECT_EQ(log->size(), seen.ok() ? 1 : 0);
  }
}

TEST(LoggedProbe, asks_for_no_more_at_once_than_may_be_lost) {
  const DenseTransport scene = facing_planes({6, 5});
  DenseProbe dense(scene);
  FailingProbe failing(dense, 6);
  const auto log = make_memory_log(dense.grid(), 1);
  LoggedProbe probe(failing, *log, 3);
  const auto failed = probe.measure(some_patterns({6, 5}, 8));
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, ErrorCode::device_lost);
  EXPECT_EQ(failing.asked, (std::vector<std::size_t>{3, 3, 2}));
  EXPECT_EQ(log->size(), 6);
}

/// A camera with so little noise that the rounding of a log is much of it.
class FineCamera final : public Probe {
 public:
  FineCamera(Grid cells, const Image<float>& steps) : cells_(cells), steps_(steps) {}
  Grid grid() const override { return cells_; }
  Grid camera_grid() const override { return steps_.grid(); }
  int channels() const override { return steps_.channels(); }
  std::string describe() const override { return "a camera"; }
  ProbeCost cost() const override { return {}; }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    std::vector<Radiance> photographs;
    for (std::size_t k = 0; k < patterns.size(); ++k) {
      Radiance& one = photographs.emplace_back(Radiance{Image<float>(steps_.grid(), channels()),
                                                        Image<float>(steps_.grid(), channels()),
                                                        Image<std::uint8_t>(steps_.grid(), channels(), 1)});
      for (std::size_t i = 0; i < steps_.values().size(); ++i) {
        const float step = steps_.values()[i];
        one.mean.values()[i] = static_cast<float>(random_.uniform()) * 1000 * step;
        one.variance.values()[i] = static_cast<float>(random_.uniform()) * step * step / 5;
      }
    }
    return photographs;
  }

 private:
  Grid cells_;
  const Image<float>& steps_;
  Random random_{11};
};

// A capture sees what the log gives to one that is continued, to the last bit.
TEST_F(PhotographLogFile, a_capture_sees_what_its_log_holds) {
  const Grid camera{40, 9};
  identity_.steps = some_steps(camera, identity_.channels);
  const auto log = *create_photograph_log(path(), identity_);
  FineCamera rig(identity_.grid, *identity_.steps);
  const std::vector<Pattern> patterns(3, Pattern(identity_.grid, 1, 1.F));
  const auto seen = LoggedProbe(rig, *log).measure(patterns);
  ASSERT_TRUE(seen.ok()) << seen.error().line();
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    const Radiance held = *log->photograph(static_cast<std::int64_t>(k));
    EXPECT_TRUE(same_bits((*seen)[k].mean.values(), held.mean.values())) << k;
    EXPECT_TRUE(same_bits((*seen)[k].variance.values(), held.variance.values())) << k;
    EXPECT_EQ((*seen)[k].valid, held.valid) << k;
  }
}

TEST(LoggedProbe, refuses_a_log_of_other_patterns) {
  const DenseTransport scene = facing_planes({6, 5});
  DenseProbe dense(scene);
  const auto log = make_memory_log(dense.grid(), 1);
  const auto patterns = some_patterns({6, 5}, 4);
  ASSERT_TRUE(LoggedProbe(dense, *log).measure(patterns).ok());
  const std::vector<Pattern> others{patterns[0], patterns[2]};
  const auto refused = LoggedProbe(dense, *log).measure(others);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_format);
  EXPECT_NE(refused.error().what.find("photograph 1"), std::string::npos) << refused.error().line();
  EXPECT_EQ(log->size(), 4);
}

TEST(LoggedProbe, tells_the_rig_once_what_was_spent_and_counts_on) {
  const DenseTransport scene = facing_planes({6, 5});
  const auto log = make_memory_log({6, 5}, 1);
  const auto patterns = some_patterns({6, 5}, 5);
  DenseProbe first(scene);
  ASSERT_TRUE(LoggedProbe(first, *log).measure(std::span(patterns).first(3)).ok());
  DenseProbe second(scene);
  ASSERT_TRUE(second.measure(std::span(patterns).first(2)).ok());  // a new session's metering
  FailingProbe rig(second, kNever);
  LoggedProbe probe(rig, *log);
  ASSERT_TRUE(probe.measure(std::span(patterns).first(2)).ok());
  EXPECT_EQ(probe.cost().photographs, 2);
  EXPECT_TRUE(rig.continued.empty());
  ASSERT_TRUE(probe.measure(std::span(patterns).subspan(2, 2)).ok());  // one from the log, one new
  ASSERT_TRUE(probe.measure(std::span(patterns).subspan(4)).ok());
  ASSERT_EQ(rig.continued.size(), 1U);
  EXPECT_EQ(rig.continued[0].photographs, 3);
  EXPECT_EQ(rig.asked, (std::vector<std::size_t>{1, 1}));
  EXPECT_EQ(probe.replayed(), 3);
  EXPECT_EQ(probe.cost().photographs, 5);
  EXPECT_EQ(log->size(), 5);
}

TEST(LoggedProbe, a_capture_that_is_broken_off_and_continued_is_the_same) {
  tests::expect_continued_is_the_same("sim:vgroove-textured?size=13x17&noise=off");
}

}  // namespace

}  // namespace symrig::logged_probe_test
