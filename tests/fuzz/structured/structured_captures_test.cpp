// SPDX-License-Identifier: Apache-2.0
// Photograph logs whose records have other values in them and a checksum that is right: a capture that goes
// on from one refuses it, or gives a finite tensor.
// Matrix files with other words in them: refused in one line that names the file, or read as the finite
// matrix that they now are.
// Registration files with other values, shapes and types in them: refused in one line, or read as the
// registration that they now are, with which everything that commands do works.
#include "campaign.hpp"
#include "dense_scene.hpp"
#include "mutators.hpp"
#include "scratch.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/files.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/protocol/crc32c.hpp"
#include "symrig/report/calibration_summary.hpp"
#include "symrig/sim/dense_rig.hpp"
#include "tensor/h5_file.hpp"
#include "unit/calibration/small_registration.hpp"
#include "unit/sim/mat_bytes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace symrig::structured::structured_captures_test {
namespace {

using Bytes = std::vector<std::byte>;

constexpr std::size_t kFront = 16;

std::uint64_t word_at(const Bytes& log, std::size_t at, std::size_t size) {
  std::uint64_t word = 0;
  std::memcpy(&word, log.data() + at, size);
  return word;
}

/// Where the records begin, behind their fronts, and how long they are.
std::vector<std::pair<std::size_t, std::size_t>> records_of(const Bytes& log) {
  std::vector<std::pair<std::size_t, std::size_t>> records;
  const std::size_t text = word_at(log, 16, 8);
  for (std::size_t at = (24 + text + 7) / 8 * 8; at + kFront <= log.size();) {
    records.emplace_back(at + kFront, static_cast<std::size_t>(word_at(log, at + 8, 8)));
    at = records.back().first + records.back().second;
  }
  return records;
}

template <class T>
void put(Bytes& log, std::size_t at, T value) {
  std::memcpy(log.data() + at, &value, sizeof value);
}

/// The fixed front of a record: two counts, three times, two words. Behind it floats and bits.
void change_record(Bytes& log, std::size_t begin, std::size_t size, Random& random) {
  const std::size_t field = below(random, 10);
  if (field < 2) {
    put(log, begin + 8 * field,
        other_integer(random, static_cast<std::int64_t>(word_at(log, begin + 8 * field, 8))));
  } else if (field < 5) {
    put(log, begin + 8 * field, other_real(random, 1));
  } else if (field < 6) {
    put(log, begin + 40 + 4 * static_cast<std::size_t>(below(random, 2)),
        static_cast<std::uint32_t>(other_integer(random, 0)));
  } else {
    const std::size_t at = begin + 48 + 4 * static_cast<std::size_t>(below(random, (size - 48) / 4));
    put(log, at, static_cast<float>(other_real(random, 0.5)));
  }
}

void mutate_log(Bytes& log, Random& random) {
  const auto records = records_of(log);
  const auto [begin, size] = records[below(random, records.size())];
  for (std::uint64_t k = 1 + below(random, 2); k > 0; --k) change_record(log, begin, size, random);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(log.data() + begin);
  put(log, begin - kFront + 4, protocol::crc32c({bytes, size}));
}

/// A scene of 4 × 4 pixels that scatters light.
tests::DenseTransport scattering() {
  return {Grid{4, 4}, [](int i, int j) { return i == j ? 1.0 : 0.05 / (1 + std::abs(i - j)); }};
}

TEST(StructuredLogs, are_refused_or_give_a_tensor_that_is_finite) {
  const test::Scratch folder;
  const auto path = folder / "scene.h5.log";
  const tests::DenseTransport truth = scattering();
  const LogIdentity identity{truth.grid(), 1, "dense", ""};
  {
    tests::DenseProbe probe(truth);
    auto log = create_photograph_log(path, identity);
    ASSERT_TRUE(log.ok());
    LoggedProbe logged(probe, **log);
    ASSERT_TRUE(capture(logged, {}).ok());
  }
  const Bytes whole = *read_file(path);
  ASSERT_GT(records_of(whole).size(), 5U);
  int refused = 0;
  campaign([&](std::uint64_t number) {
    Random random(number);
    Bytes mutated = whole;
    mutate_log(mutated, random);
    ASSERT_TRUE(write_file_atomically(path, std::span<const std::byte>(mutated)).ok());
    auto log = open_photograph_log(path, identity);
    if (!log.ok()) {
      EXPECT_EQ(exit_code(log.error().code), 4) << log.error().line();
      return;
    }
    tests::DenseProbe probe(truth);
    LoggedProbe logged(probe, **log);
    CaptureOptions options;
    options.log = log->get();
    const auto result = capture(logged, options);
    refused += result.ok() ? 0 : 1;
    if (!result.ok()) return;
    const auto seen = result->tensor.apply(Image<float>(truth.grid(), 1, 1.0F));
    ASSERT_TRUE(seen.ok());
    for (const float v : seen->values()) {
      EXPECT_TRUE(std::isfinite(v));
    }
  });
  if (std::getenv("SYMRIG_CASE") == nullptr) {
    EXPECT_GT(refused, 20);
  }
}

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

namespace fs = std::filesystem;

/// All that capture, evaluate and calibrate do with a registration.
void use_as_commands_do(const Registration& registration) {
  const auto weights = registration.weights();
  if (!weights) {  // maps that fold, or look away from all cells, give weights or one line
    EXPECT_EQ(weights.error().line().find('\n'), std::string::npos);
    return;
  }
  const auto cells = weights->gather(registration.flood);
  ASSERT_TRUE(cells.ok()) << cells.error().line();
  for (const float v : cells->variance.values()) ASSERT_GE(v, 0);
  const RegistrationSummary summary{registration, *weights, 1, {}};
  EXPECT_FALSE(registration_json(summary).empty());
  EXPECT_FALSE(registration_text(summary).empty());
  EXPECT_TRUE(registration_page(summary).ok());
  const int channels = registration.flood.mean.channels();
  const Grid camera = registration.camera();
  const Radiance stripe{Image<float>(camera, channels, 0.5F), Image<float>(camera, channels, 1e-4F),
                        Image<std::uint8_t>(camera, channels, std::uint8_t{1})};
  const std::vector<Radiance> now(2, stripe);
  const auto motion = registration.watch().compare(now);
  EXPECT_TRUE(motion.ok() || motion.error().code == ErrorCode::bad_value) << motion.error().line();
}

TEST(StructuredRegistrations, are_refused_in_one_line_or_work) {
  const test::Scratch folder;
  const fs::path original = folder / "whole.h5", file = folder / "mutated.h5";
  Registration shared = tests::small_registration();
  shared.ghost.found = true;
  shared.ghost.share = 0.01, shared.ghost.place = {1.5, -2};
  ASSERT_TRUE(save_registration(original, shared).ok());
  int refused = 0, read = 0;
  campaign([&](std::uint64_t number) {
    Random random(number);
    fs::copy_file(original, file, fs::copy_options::overwrite_existing);
    SCOPED_TRACE(mutate_scene(file, random));
    const auto registration = load_registration(file);
    registration.ok() ? ++read : ++refused;
    if (registration.ok()) return use_as_commands_do(*registration);
    EXPECT_EQ(exit_code(registration.error().code), 4) << registration.error().line();
    EXPECT_EQ(registration.error().line().find('\n'), std::string::npos);
    EXPECT_NE(registration.error().line().find("mutated.h5"), std::string::npos)
        << registration.error().line();
  });
  if (std::getenv("SYMRIG_CASE") == nullptr) {
    EXPECT_GT(refused, read / 10);
    EXPECT_GT(read, refused / 100);
  }
}

}  // namespace
}  // namespace symrig::structured::structured_captures_test
