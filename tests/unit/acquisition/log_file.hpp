// SPDX-License-Identifier: Apache-2.0
// Photographs with floats of every kind, and a folder with a log of them.
#pragma once

#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <fstream>
#include <memory>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

namespace symrig::tests {

namespace fs = std::filesystem;

struct Entry {
  Pattern pattern;
  Radiance photograph;
  ProbeCost spent;
};

/// Floats of every kind: a log must not care.
inline float any_float(Random& random) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
}

/// camera: the grid of the photograph, if it is another one.
inline Entry random_entry(Grid grid, int channels, bool binary, std::uint64_t seed,
                          std::optional<Grid> camera = {}) {
  Random random(seed);
  const Grid seen = camera.value_or(grid);
  Entry entry{Pattern(grid),
              Radiance{Image<float>(seen, channels), Image<float>(seen, channels),
                       Image<std::uint8_t>(seen, channels)},
              ProbeCost{static_cast<std::int64_t>(seed), 1 - static_cast<std::int64_t>(seed),
                        random.uniform(), random.uniform(), random.uniform()}};
  for (float& v : entry.pattern.values())
    v = binary ? static_cast<float>(random.bits() >> 63U) : any_float(random);
  for (float& v : entry.photograph.mean.values()) v = any_float(random);
  for (float& v : entry.photograph.variance.values()) v = any_float(random);
  for (std::uint8_t& v : entry.photograph.valid.values()) v = static_cast<std::uint8_t>(random.bits() >> 63U);
  return entry;
}

inline bool same_bits(std::span<const float> a, std::span<const float> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](float x, float y) {
    return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
  });
}

inline void expect_holds(const PhotographLog& log, std::int64_t k, const Entry& entry) {
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

/// Steps of a camera, each another one.
inline std::shared_ptr<const Image<float>> some_steps(Grid camera, int channels) {
  Image<float> steps(camera, channels);
  for (std::size_t i = 0; i < steps.values().size(); ++i)
    steps.values()[i] = 1e-3F * (1 + static_cast<float>(i % 7));
  return std::make_shared<const Image<float>>(std::move(steps));
}

inline void append(PhotographLog& log, const Entry& entry) {
  const auto done = log.append(entry.pattern, entry.photograph, entry.spent);
  ASSERT_TRUE(done.ok()) << done.error().line();
}

/// Photographs [first, first + count) of `entries` as one run.
inline void append_run(PhotographLog& log, const std::vector<Entry>& entries, std::size_t first,
                       std::size_t count) {
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

  /// Entry k as the log gives it back.
  Entry kept(const PhotographLog& log, std::int64_t k) const {
    Entry entry = entries_[k];
    entry.photograph = log.kept(entry.photograph);
    return entry;
  }

  LogIdentity identity_{{3, 5}, 2, "sim:plane", "algorithm symrig\n"};
  std::vector<Entry> entries_;
  std::uint64_t head_ = 0;

 private:
  fs::path folder_;
};

inline std::vector<std::uint64_t> PhotographLogFile::write_three_runs() {
  for (std::uint64_t k = 0; k < 5; ++k)
    entries_.push_back(random_entry(identity_.grid, identity_.channels, k % 2 == 0, k, identity_.camera()));
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

/// Photographs in the first 0, 1, 2, 3 runs.
inline constexpr std::array<std::int64_t, 4> kPhotographsInRuns{0, 2, 3, 5};

}  // namespace symrig::tests
