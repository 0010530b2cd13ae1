// SPDX-License-Identifier: Apache-2.0
// Every fuzz target over its seeds and over random inputs. A broken invariant aborts: the test dies by name.
#include "targets.hpp"
#include "unit/protocol/random_program.hpp"

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::fuzz::fuzz_targets_test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Target = void (*)(const std::uint8_t*, std::size_t);

Bytes bytes_of(const std::string& hexadecimal) {
  Bytes bytes;
  if (hexadecimal == "-") return bytes;
  for (std::size_t at = 0; at + 1 < hexadecimal.size(); at += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(hexadecimal.substr(at, 2), nullptr, 16)));
  return bytes;
}

/// From the list that make_seeds.py writes: target, name, bytes.
std::vector<Bytes> seeds(const std::string& target) {
  std::vector<Bytes> found;
  std::ifstream list(SYMRIG_SEEDS);
  for (std::string of, name, hexadecimal; list >> of >> name >> hexadecimal;)
    if (of == target) found.push_back(bytes_of(hexadecimal));
  return found;
}

/// Half of the inputs are random bytes, half are seeds with some bytes changed, cut or doubled.
Bytes random_input(test::Random& random, const std::vector<Bytes>& corpus) {
  if (random.chance(50)) {
    Bytes bytes(random.range(0, 400));
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.next());
    return bytes;
  }
  Bytes bytes = corpus[random.range(0, corpus.size() - 1)];
  if (random.chance(30)) bytes.insert(bytes.end(), bytes.begin(), bytes.end());
  for (std::uint64_t k = random.range(0, 6); k > 0 && !bytes.empty(); --k)
    bytes[random.range(0, bytes.size() - 1)] = static_cast<std::uint8_t>(random.next());
  if (random.chance(20)) bytes.resize(random.range(0, bytes.size()));
  return bytes;
}

void run(Target target, const std::string& name, int inputs) {
  const std::vector<Bytes> corpus = seeds(name);
  ASSERT_FALSE(corpus.empty()) << name;
  for (const Bytes& seed : corpus) target(seed.data(), seed.size());
  test::Random random(20'061);
  for (int k = 0; k < inputs; ++k) {
    const Bytes input = random_input(random, corpus);
    target(input.data(), input.size());
  }
}

TEST(Fuzz, frame) {
  run(fuzz_frame, "frame", 20'000);
}
TEST(Fuzz, messages) {
  run(fuzz_messages, "messages", 20'000);
}
TEST(Fuzz, program) {
  run(fuzz_program, "program", 5'000);
}
TEST(Fuzz, board) {
  run(fuzz_board, "board", 3'000);
}
TEST(Fuzz, link) {
  run(fuzz_link, "link", 20'000);
}
TEST(Fuzz, refill) {
  run(fuzz_refill, "refill", 20'000);
}
TEST(Fuzz, settings) {
  run(fuzz_settings, "settings", 20'000);
}
TEST(Fuzz, camera) {
  run(fuzz_camera, "camera", 2'000);
}
TEST(Fuzz, hdf5) {
  run(fuzz_hdf5, "hdf5", 1'000);
}
TEST(Fuzz, reply) {
  run(fuzz_reply, "reply", 2'000);
}

}  // namespace
}  // namespace symrig::fuzz::fuzz_targets_test
