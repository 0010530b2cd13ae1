// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

#include <sys/resource.h>

namespace symrig::test::resume_test {
namespace {

namespace fs = std::filesystem;
using Resume = CommandTest;
using Words = std::vector<std::string>;

constexpr const char* kSlow = "sim:gummy?size=160x160";

Words capture_of(const std::string& rig, const Words& more = {}) {
  Words words{"capture", "--rig", rig, "-o", "scene.h5"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// Until the file has that many bytes. False after ten minutes: ends a broken test, decides nothing.
bool wait_for(const fs::path& file, std::uintmax_t bytes) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(10);
  std::error_code missing;
  while (std::chrono::steady_clock::now() < end) {
    const std::uintmax_t size = fs::file_size(file, missing);
    if (!missing && size >= bytes) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return false;
}

/// Commands started while it lives can write no file beyond `bytes`: what a full disk does.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

TEST_F(Resume, a_finished_capture_leaves_a_log_only_if_it_is_to_be_kept) {
  for (const Words& more : {Words{}, Words{"--no-log"}, Words{"--resume"}}) {
    ASSERT_EQ(symrig(capture_of(kSmall, more)).code, 0);
    EXPECT_EQ(files(), std::set<std::string>{"scene.h5"});
  }
  ASSERT_EQ(symrig(capture_of(kSmall, {"--keep-log", "--json", "first.json"})).code, 0);
  EXPECT_EQ(files(), (std::set<std::string>{"first.json", "scene.h5", "scene.h5.log"}));
  const Outcome again = symrig(capture_of(kSmall, {"--resume", "--json", "again.json"}));
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(files(), (std::set<std::string>{"again.json", "first.json", "scene.h5"}));
  EXPECT_EQ(json("first.json").at("replayed"), 0);
  EXPECT_EQ(json("again.json").at("replayed"), json("first.json").at("patterns"));
  for (const char* key : {"patterns", "frames", "rig_seconds", "tensor_bytes"})
    EXPECT_EQ(json("again.json").at(key), json("first.json").at(key)) << key;
}

TEST_F(Resume, control_c_keeps_the_photographs) {
  Running capture(path(""), capture_of(kSlow));
  ASSERT_TRUE(wait_for(path("scene.h5.log"), 1'000'000));  // four photographs
  capture.signal(SIGINT);
  const Outcome outcome = capture.wait();
  EXPECT_EQ(outcome.code, kFault);
  for (const char* word : {"stopped", "scene.h5.log", "--resume"})
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
  EXPECT_EQ(files(), std::set<std::string>{"scene.h5.log"});
}

TEST_F(Resume, without_a_log_control_c_leaves_nothing) {
  Running capture(path(""), capture_of(kSlow, {"--no-log"}));
  ASSERT_TRUE(capture.works(SIGINT, 0.5));
  capture.signal(SIGINT);
  const Outcome outcome = capture.wait();
  EXPECT_EQ(outcome.code, kFault);
  EXPECT_NE(outcome.err.find("stopped"), std::string::npos) << outcome.err;
  EXPECT_EQ(files(), std::set<std::string>{});
}

TEST_F(Resume, a_log_is_neither_overwritten_nor_mistaken) {
  ASSERT_EQ(symrig(capture_of(kSmall, {"--keep-log"})).code, 0);
  const std::string before = read_text(path("scene.h5.log"));
  expect_refusal(capture_of(kSmall), kUsage, {"scene.h5.log", "--resume", "delete"});
  expect_refusal(capture_of(std::string(kSmall) + "&seed=2", {"--resume"}), kBadInput,
                 {"scene.h5.log", "another capture", "seed=2"});
  expect_refusal(capture_of("sim:vgroove-textured?size=12x18&noise=off", {"--resume"}), kBadInput,
                 {"grid 12x17", "grid 12x18"});
  expect_refusal(capture_of(kSmall, {"--resume", "--algorithm", "paper"}), kBadInput,
                 {"algorithm symrig", "algorithm paper"});
  expect_refusal(capture_of(kSmall, {"--resume", "--tolerance", "0.01"}), kBadInput,
                 {"rule.flood_fraction 0.0003", "rule.flood_fraction 0.01"});
  expect_refusal(capture_of(kSmall, {"--resume", "--no-log"}), kUsage, {"--no-log", "--resume"});
  EXPECT_EQ(read_text(path("scene.h5.log")), before);
  write_text(path("scene.h5.log"), "notes of somebody else");
  expect_refusal(capture_of(kSmall, {"--resume"}), kBadInput, {"scene.h5.log", "not a photograph log"});
}

TEST_F(Resume, two_captures_do_not_share_a_log) {
  Running capture(path(""), capture_of(kSlow));
  ASSERT_TRUE(wait_for(path("scene.h5.log"), 1));
  const Outcome second = symrig(capture_of(kSlow, {"--resume"}));
  EXPECT_EQ(second.code, kBadInput);
  EXPECT_NE(second.err.find("another process"), std::string::npos) << second.err;
}

TEST_F(Resume, a_full_disk_ends_it_in_one_line_and_costs_no_photograph) {
  ASSERT_EQ(symrig(capture_of(kSmall, {"--keep-log", "--json", "whole.json"})).code, 0);
  const std::string log = read_text(path("scene.h5.log"));
  fs::remove(path("scene.h5.log"));
  fs::remove(path("scene.h5"));
  std::optional<FullDisk> full(std::in_place, log.size() / 2);
  const Outcome outcome = symrig(capture_of(kSmall));
  full.reset();
  EXPECT_EQ(outcome.code, kBadInput);
  for (const char* word : {"scene.h5.log", "cannot be written", "free space", "--resume"})
    EXPECT_NE(outcome.err.find(word), std::string::npos) << word << " in: " << outcome.err;
  EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
  const std::string kept = read_text(path("scene.h5.log"));
  // No photograph that fits is missing: at most a run of four does not fit.
  const double run = 4.0 * static_cast<double>(log.size()) / json("whole.json").at("patterns").get<double>();
  EXPECT_GE(static_cast<double>(kept.size()), static_cast<double>(log.size()) / 2 - 2 * run);
  ASSERT_EQ(symrig(capture_of(kSmall, {"--resume", "--json", "resumed.json"})).code, 0);
  EXPECT_GT(json("resumed.json").at("replayed"), 0);
  EXPECT_EQ(json("resumed.json").at("patterns"), json("whole.json").at("patterns"));
}

// The tensor does not fit, its log does: nothing has to be measured again.
TEST_F(Resume, when_the_scene_cannot_be_saved_the_log_stays) {
  ASSERT_EQ(symrig(capture_of(kSmall, {"--keep-log"})).code, 0);
  fs::remove(path("scene.h5"));
  std::optional<FullDisk> full(std::in_place, 1000);
  const Outcome outcome = symrig(capture_of(kSmall, {"--resume"}));
  full.reset();
  EXPECT_EQ(outcome.code, kBadInput);
  for (const char* word : {"scene.h5", "cannot be written", "scene.h5.log keeps", "--resume"})
    EXPECT_NE(outcome.err.find(word), std::string::npos) << word << " in: " << outcome.err;
  EXPECT_EQ(files(), std::set<std::string>{"scene.h5.log"});
}

TEST_F(Resume, wrong_budgets_are_usage_errors) {
  for (const char* value : {"0", "-5", "1.5", "many"})
    expect_refusal(capture_of(kSmall, {std::string("--max-patterns=") + value}), kUsage, {"--max-patterns"});
  for (const char* value : {"0", "-1", "nan", "inf", "long"})
    expect_refusal(capture_of(kSmall, {std::string("--max-seconds=") + value}), kUsage, {"--max-seconds"});
  for (const char* value : {"0", "-1", "1", "nan", "small"})
    expect_refusal(capture_of(kSmall, {std::string("--target-error=") + value}), kUsage, {"--target-error"});
}

TEST_F(Resume, a_capture_within_its_budgets_says_that_it_is_done) {
  const Outcome outcome = symrig(
      capture_of(kSmall, {"--max-patterns", "100000", "--max-seconds", "1e9", "--json", "capture.json"}));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const nlohmann::json j = json("capture.json");
  EXPECT_EQ(j.at("stopped_by"), "done");
  EXPECT_TRUE(j.at("error_per_level").is_array());
  EXPECT_TRUE(j.contains("estimated_error"));
}

// A scene file that was cut or altered on its way: refused in one line, or read as the valid file that it
// still is. A flipped bit of a factor, say, is another valid number; the format has no checksum over the
// numbers.

/// Each case starts the command. tests/fuzz/structured tries many more in one process.
std::size_t cases(std::size_t usual, std::size_t in_a_campaign) {
  return std::getenv("SYMRIG_LONG") != nullptr ? in_a_campaign : usual;
}

class Corrupt : public CommandTest {
 protected:
  void SetUp() override {
    capture_small();
    whole_ = read_text(path("scene.h5"));
    ASSERT_GT(whole_.size(), 1000U);
  }
  std::string whole_;
};

TEST_F(Corrupt, a_truncated_file_is_refused_wherever_it_was_cut) {
  const std::size_t cuts = cases(16, 48);
  for (std::size_t k = 0; k < cuts; ++k) {
    const std::size_t size = whole_.size() * k / cuts;
    write_text(path("cut.h5"), whole_.substr(0, size));
    expect_refusal({"inspect", "cut.h5"}, kBadInput, {"cut.h5"});
    if (HasFailure()) FAIL() << "cut to " << size << " bytes";
  }
  write_text(path("cut.h5"), whole_.substr(0, whole_.size() - 1));
  expect_refusal({"relight", "cut.h5", "--light", "white", "-o", "out.exr"}, kBadInput, {"cut.h5"});
  expect_refusal({"report", "cut.h5", "-o", "out.html"}, kBadInput, {"cut.h5"});
  expect_refusal({"evaluate", "cut.h5", "--rig", kSmall}, kBadInput, {"cut.h5"});
}

// Offsets from a linear congruential sequence, dense in the head, where the structure of HDF5 is.
TEST_F(Corrupt, a_flipped_bit_is_refused_or_harmless) {
  const std::size_t flips = cases(60, 240);
  std::uint64_t state = 12345;
  int refused = 0;
  for (std::size_t k = 0; k < flips; ++k) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    const std::size_t range = k % 2 == 0 ? whole_.size() : std::min<std::size_t>(whole_.size(), 4096);
    const std::size_t offset = static_cast<std::size_t>(state >> 33U) % range;
    std::string flipped = whole_;
    flipped[offset] = static_cast<char>(static_cast<unsigned char>(flipped[offset]) ^ (1U << (k % 8)));
    write_text(path("flipped.h5"), flipped);
    std::filesystem::remove(path("out.exr"));
    const Outcome outcome = symrig({"relight", "flipped.h5", "--light", "white", "-o", "out.exr"});
    ASSERT_TRUE(outcome.code == 0 || outcome.code == kBadInput)
        << "offset " << offset << ", bit " << k % 8 << ": code " << outcome.code << ": " << outcome.err;
    const std::set<std::string> expected = outcome.code == 0
                                               ? std::set<std::string>{"flipped.h5", "out.exr", "scene.h5"}
                                               : std::set<std::string>{"flipped.h5", "scene.h5"};
    ASSERT_EQ(files(), expected) << "offset " << offset;
    if (outcome.code == 0) continue;
    ++refused;
    ASSERT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
    ASSERT_NE(outcome.err.find("flipped.h5"), std::string::npos) << outcome.err;
  }
  EXPECT_GT(refused, 0);  // some of these flips hit the structure
}

}  // namespace
}  // namespace symrig::test::resume_test
