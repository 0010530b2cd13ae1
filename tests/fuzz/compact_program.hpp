// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "unit/protocol/random_program.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::fuzz {

/// Takes an input apart; at its end there are zeros.
class Input {
 public:
  explicit Input(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool empty() const { return bytes_.empty(); }
  std::uint8_t byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t value = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return value;
  }
  std::uint32_t word() {
    const std::uint32_t high = byte();
    return high << 8U | byte();
  }
  std::vector<std::uint8_t> bytes(std::size_t count) {
    const auto part = bytes_.first(count < bytes_.size() ? count : bytes_.size());
    bytes_ = bytes_.subspan(part.size());
    return {part.begin(), part.end()};
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

/// How two bytes become a record.
struct CompactRecords {
  std::uint32_t outputs = 7;     // lines that words may set
  std::uint32_t word_ticks = 4;  // of one unit of the second byte
  std::uint32_t wait_ticks = 8;
  std::uint32_t rounds = 20;
  std::uint32_t final_levels = 3;  // lines that End may leave on
};

/// Records of two bytes each, so that sound programs are common.
inline std::vector<std::uint8_t> compact_program(Input& input, std::size_t records,
                                                 const CompactRecords& code = {}) {
  using protocol::Op;
  std::vector<std::uint8_t> out;
  for (std::size_t i = 0; i < records; ++i) {
    const std::uint8_t a = input.byte();
    const std::uint8_t b = input.byte();
    switch (a >> 5U) {
      case 0:
        test::pack(protocol::make_loop(b % code.rounds), out);
        break;
      case 1:
        test::pack(protocol::make_record(Op::end_loop, 0, 0), out);
        break;
      case 2:
        test::pack(protocol::make_record(Op::mark, b, 0), out);
        break;
      case 3:
        test::pack(protocol::make_wait({3, protocol::WaitFor::both, (a & 1U) != 0}, b * code.wait_ticks),
                   out);
        break;
      default:
        test::pack(protocol::make_record(Op::set_word, a & code.outputs, b * code.word_ticks), out);
        break;
    }
  }
  test::pack(protocol::make_record(Op::end, input.byte() & code.final_levels, 0), out);
  return out;
}

}  // namespace symrig::fuzz
