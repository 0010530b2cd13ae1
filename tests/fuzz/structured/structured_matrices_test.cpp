// SPDX-License-Identifier: Apache-2.0
// Matrix files with other words in them: refused in one line that names the file, or read as the finite
// matrix that they now are.
#include "campaign.hpp"
#include "scene_mutator.hpp"
#include "scratch.hpp"
#include "symrig/sim/dense_rig.hpp"
#include "tensor/h5_file.hpp"
#include "unit/sim/mat_bytes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace symrig::structured::structured_matrices_test {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kSide = 16;

std::string numbers() {
  std::vector<double> values(std::size_t{kSide} * kSide);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = static_cast<double>(k % 7);
  return test::raw_bytes(std::span<const double>(values));
}

/// Whole files of each kind.
std::vector<std::string> whole_files() {
  const std::string size = test::mat_variable("light_size", 1, 2, 2, "\x04\x04");
  const std::string matrix = test::mat_variable("T", kSide, kSide, 9, numbers());
  std::string npy = "{'descr': '<f8', 'fortran_order': False, 'shape': (16, 16), }";
  npy.append(118 - npy.size() - 1, ' ');
  return {test::mat_file(size + matrix),
          test::mat_file(test::mat_compressed(size) + test::mat_compressed(matrix)),
          test::level4_variable("T", kSide, kSide, 0, numbers()),
          std::string("\x93NUMPY\x01\0\x76\0", 10) + npy + '\n' + numbers()};
}

std::size_t below(Random& random, std::size_t limit) {
  return static_cast<std::size_t>(random.uniform() * static_cast<double>(limit));
}

/// Words near limits, at places that are mostly in the heads.
void mutate(std::string& bytes, Random& random) {
  constexpr std::array<std::uint32_t, 10> kWords{0,          1,          14,         15,         16,
                                                 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x00020001, 0xFFFF0001};
  for (std::size_t changes = 1 + below(random, 3); changes > 0; --changes) {
    const std::size_t reach =
        random.uniform() < 0.3 ? bytes.size() : std::min<std::size_t>(bytes.size(), 300);
    const std::size_t at = below(random, reach - 4);
    if (random.uniform() < 0.5) {
      bytes[at] = static_cast<char>(below(random, 256));
    } else {
      const std::uint32_t word = kWords[below(random, kWords.size())];
      bytes.replace(at / 4 * 4, 4, reinterpret_cast<const char*>(&word), 4);
    }
  }
}

/// How many files were refused, and how many read.
struct Outcomes {
  int refused = 0, read = 0;
};

void expect_refused_or_finite(const fs::path& file, Outcomes& outcomes) {
  const auto matrix = read_dense({file});
  matrix.ok() ? ++outcomes.read : ++outcomes.refused;
  if (matrix.ok()) {
    ASSERT_EQ(std::ssize(matrix->values), matrix->grid.size() * matrix->grid.size());
    for (const float v : matrix->values) ASSERT_TRUE(std::isfinite(v));
    return;
  }
  const std::string line = matrix.error().line();
  EXPECT_TRUE(exit_code(matrix.error().code) == 4 || matrix.error().code == ErrorCode::limit) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  EXPECT_NE(line.find("mutated"), std::string::npos) << line;
}

TEST(StructuredMatrices, are_refused_in_one_line_or_finite) {
  const test::Scratch folder;
  const fs::path file = folder / "mutated";
  for (const std::string& whole : whole_files()) {
    Outcomes outcomes;
    std::ofstream(file, std::ios::binary) << whole;
    const auto original = read_dense({file});
    ASSERT_TRUE(original.ok()) << original.error().line();
    campaign([&](std::uint64_t number) {
      Random random(number);
      std::string bytes = whole;
      mutate(bytes, random);
      std::ofstream(file, std::ios::binary) << bytes;
      expect_refused_or_finite(file, outcomes);
    });
    if (std::getenv("SYMRIG_CASE") != nullptr) continue;
    EXPECT_GT(outcomes.refused, 30);
    EXPECT_GT(outcomes.read, 3);
  }
}

/// The same in HDF5, by way of its library.
TEST(StructuredMatrices, hdf5_is_refused_in_one_line_or_finite) {
  const test::Scratch folder;
  const fs::path original = folder / "whole.h5", file = folder / "mutated.h5";
  const std::vector<float> values(std::size_t{kSide} * kSide, 0.5F);
  namespace h5 = tensor::h5;
  ASSERT_TRUE(h5::write_file(original, [&](hid_t to) {
                return h5::write_dataset<float>(to, "T", {kSide, kSide}, values) &&
                       h5::write_dataset<float>(to, "other", {kSide}, std::span(values).first(kSide)) &&
                       h5::write_attribute(to, "made_by", "a test");
              }).ok());
  Outcomes outcomes;
  campaign([&](std::uint64_t number) {
    Random random(number);
    fs::copy_file(original, file, fs::copy_options::overwrite_existing);
    SCOPED_TRACE(mutate_scene(file, random));
    expect_refused_or_finite(file, outcomes);
  });
  if (std::getenv("SYMRIG_CASE") == nullptr) {
    EXPECT_GT(outcomes.refused, 30);
  }
}

}  // namespace
}  // namespace symrig::structured::structured_matrices_test
