// SPDX-License-Identifier: Apache-2.0
// Photograph logs whose records have other values in them and a checksum that is right: a capture that goes
// on from one refuses it, or gives a finite tensor.
#include "campaign.hpp"
#include "dense_scene.hpp"
#include "scratch.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/atomic_file.hpp"
#include "symrig/protocol/crc32c.hpp"
#include "values.hpp"

#include <cmath>
#include <cstring>
#include <vector>

namespace symrig::structured::structured_logs_test {
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

}  // namespace
}  // namespace symrig::structured::structured_logs_test
