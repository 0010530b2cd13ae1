// SPDX-License-Identifier: Apache-2.0
// Vectors whose memory may be a scratch file.
#include "symrig/base/paged_vector.hpp"

#include "symrig/base/memory.hpp"
#include "symrig/base/text.hpp"

#include <cstdlib>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::paged_vector_test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMany = std::size_t{3} << 17;  // 1.5 MB of numbers

class Paged : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "symrig-paged-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    if (GetParam()) scope_.emplace(MemoryBudget{1, 0, folder_});  // everything large goes to files
  }
  void TearDown() override {
    EXPECT_TRUE(fs::is_empty(folder_)) << "a scratch file has a name";
    scope_.reset();
    fs::remove_all(folder_);
  }
  static void expect_place(bool in_files) {
    EXPECT_EQ(MemoryScope::scratch_bytes() >= static_cast<std::int64_t>(kMany * sizeof(int)), in_files);
  }
  fs::path folder() const { return folder_; }

 private:
  fs::path folder_;
  std::optional<MemoryScope> scope_;
};

INSTANTIATE_TEST_SUITE_P(Places, Paged, testing::Values(false, true),
                         [](const auto& place) { return place.param ? "in_files" : "in_memory"; });

TEST_P(Paged, holds_what_a_vector_holds) {
  PagedVector<int> paged;
  std::vector<int> plain;
  for (std::size_t k = 0; k < kMany; ++k) {
    paged.push_back(static_cast<int>(k * 7));
    plain.push_back(static_cast<int>(k * 7));
  }
  expect_place(GetParam());
  const std::vector<int> more(1000, -3);
  paged.append(more.begin(), more.end());
  plain.insert(plain.end(), more.begin(), more.end());
  paged.resize(paged.size() + 10);
  plain.resize(plain.size() + 10);
  EXPECT_TRUE(std::equal(paged.begin(), paged.end(), plain.begin(), plain.end()));
  PagedVector<int> copy = paged;
  copy[5] = 1;
  EXPECT_FALSE(copy == paged);
  EXPECT_EQ(paged[5], 35);
  const PagedVector<int> moved = std::move(copy);
  EXPECT_EQ(moved[5], 1);
  EXPECT_EQ(moved.size(), plain.size());
  paged.assign(4, 9);
  EXPECT_EQ(std::accumulate(paged.begin(), paged.end(), 0), 36);
  paged.clear();
  EXPECT_TRUE(paged.empty());
}

TEST_P(Paged, a_copy_has_no_room_for_more) {
  const PagedVector<int> all(kMany);
  const std::int64_t before = MemoryScope::scratch_bytes();
  // The copy is what is tested. NOLINTNEXTLINE(performance-unnecessary-copy-initialization)
  const PagedVector<int> copy = all;
  EXPECT_EQ(MemoryScope::scratch_bytes() - before,
            GetParam() ? static_cast<std::int64_t>(kMany * sizeof(int)) : 0);
  EXPECT_EQ(copy.size(), all.size());
}

TEST_P(Paged, windows_show_its_values_wherever_they_are) {
  PagedVector<int> all(kMany);
  std::iota(all.begin(), all.end(), 7);
  std::vector<int> buffer;
  for (const auto& [first, count] :
       {std::pair<std::size_t, std::size_t>{0, 1}, {5, 0}, {100, 70'000}, {kMany - 3, 3}, {0, kMany}}) {
    const std::span<const int> window = all.window(first, count, buffer);
    ASSERT_EQ(window.size(), count);
    EXPECT_TRUE(std::equal(window.begin(), window.end(), all.begin() + first)) << first;
  }
  all[100] = -1;
  EXPECT_EQ(all.window(90, 20, buffer)[10], -1) << "what was just written";
  // In place unless it is in a file.
  EXPECT_EQ(all.window(1, 2, buffer).data() == all.data() + 1, !GetParam());
}

// Pages that were given back come again from the file: nothing is lost.
TEST_P(Paged, keeps_its_values_while_pages_are_given_back) {
  std::vector<PagedVector<int>> all;
  all.reserve(8);
  for (int n = 0; n < 8; ++n) {
    all.emplace_back(kMany);
    std::iota(all.back().begin(), all.back().end(), n);
  }
  for (int round = 0; round < 3; ++round)
    for (int n = 0; n < 8; ++n)
      for (std::size_t k = 0; k < kMany; ++k) {
        ASSERT_EQ(all[static_cast<std::size_t>(n)][k], static_cast<int>(k) + n + round);
        ++all[static_cast<std::size_t>(n)][k];
      }
}

#ifndef __SANITIZE_THREAD__  // its shadow of what was written stays in memory
TEST(MemoryScope, gives_pages_back_above_its_budget) {
  const std::int64_t before = resident_memory();
  constexpr std::int64_t kMore = std::int64_t{16} << 20;
  const MemoryScope scope({before + kMore, before + kMore, fs::temp_directory_path()});
  std::vector<PagedVector<int>> all;
  all.reserve(40);
  for (int n = 0; n < 40; ++n) all.emplace_back(kMany, n);  // 60 MB
  EXPECT_GE(MemoryScope::scratch_bytes(), 40 * static_cast<std::int64_t>(kMany * sizeof(int)));
  // The watch needs no more than to be scheduled; what it waits for is the number itself.
  while (resident_memory() > before + kMore) std::this_thread::yield();
  for (int n = 0; n < 40; ++n) EXPECT_EQ(all[static_cast<std::size_t>(n)].back(), n);
}
#endif

TEST(MemoryScope, ends_with_its_files) {
  {
    const MemoryScope scope({1, 0, fs::temp_directory_path()});
    const PagedVector<int> one(kMany, 4);
    EXPECT_GT(MemoryScope::scratch_bytes(), 0);
  }
  EXPECT_EQ(MemoryScope::scratch_bytes(), 0);
  const PagedVector<int> later(kMany, 4);
  EXPECT_EQ(MemoryScope::scratch_bytes(), 0);
}

// A file that is no longer needed serves the next vector. Whatever it held, new values are 0.
TEST(MemoryScope, files_are_used_again) {
  const MemoryScope scope({std::int64_t{64} << 20, std::int64_t{64} << 20, fs::temp_directory_path()});
  const int* before = nullptr;
  {
    const PagedVector<int> one(kMany, 4);
    before = one.data();
  }
  EXPECT_EQ(MemoryScope::scratch_bytes(), 0);
  const PagedVector<int> smaller(kMany - 1000);
  EXPECT_EQ(smaller.data(), before);
  EXPECT_EQ(std::accumulate(smaller.begin(), smaller.end(), 0), 0);
  const PagedVector<int> other(kMany, 5);
  EXPECT_NE(other.data(), before);
  EXPECT_GE(MemoryScope::scratch_bytes(), 2 * static_cast<std::int64_t>((kMany - 1000) * sizeof(int)));
}

// A vector that cannot grow says so, and keeps what it holds.
TEST(MemoryScope, a_folder_that_does_not_exist_is_named) {
  const MemoryScope scope({1, 0, "/no/such/folder"});
  PagedVector<int> small(10, 3);
  try {
    small.resize(kMany);
    FAIL() << "grew without a file";
  } catch (const NoScratchSpace& error) {
    EXPECT_NE(std::string(error.what()).find("/no/such/folder"), std::string::npos) << error.what();
  }
  EXPECT_EQ(small.size(), 10U);
  EXPECT_EQ(small.back(), 3);
}

TEST(ByteSize, reads_what_people_write) {
  EXPECT_EQ(*parse_byte_size("1"), 1);
  EXPECT_EQ(*parse_byte_size("10K"), 10240);
  EXPECT_EQ(*parse_byte_size("512M"), std::int64_t{512} << 20);
  EXPECT_EQ(*parse_byte_size("4G"), std::int64_t{4} << 30);
  EXPECT_EQ(*parse_byte_size("2T"), std::int64_t{2} << 40);
  for (const char* wrong :
       {"", "0", "0G", "-1", "4 G", "4GB", "4.5G", "G", "x", "4g", "9000000T", "99999999999999999999"})
    EXPECT_EQ(parse_byte_size(wrong).error().code, ErrorCode::bad_argument) << wrong;
}

TEST(Memory, states_what_is_free_and_used) {
  EXPECT_GT(available_memory(), 0);
  EXPECT_GT(usual_memory(), 0);
  const std::int64_t before = resident_memory();
  const std::vector<char> more(std::size_t{64} << 20, 1);
  EXPECT_GE(resident_memory(), before + static_cast<std::int64_t>(more.size() / 2));
  EXPECT_GE(anonymous_memory(), static_cast<std::int64_t>(more.size() / 2));
  EXPECT_LE(anonymous_memory(), resident_memory());
}

}  // namespace
}  // namespace symrig::paged_vector_test
