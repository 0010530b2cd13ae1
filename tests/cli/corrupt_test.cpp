// SPDX-License-Identifier: Apache-2.0
// A scene file that was cut or altered on its way: refused in one line, or read as the valid file that it
// still is. A flipped bit of a factor, say, is another valid number; the format has no checksum over the
// numbers.
#include "command.hpp"

#include <algorithm>
#include <cstdlib>

namespace symrig::test::corrupt_test {
namespace {

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
}  // namespace symrig::test::corrupt_test
