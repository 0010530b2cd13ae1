// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/types.hpp"

namespace symrig::protocol {

constexpr size_t kRecordSize = 8;
constexpr unsigned kMaxLoopDepth = 4;
constexpr uint32_t kMaxArg = (uint32_t{1} << 28U) - 1;
constexpr uint64_t kMaxRounds = uint64_t{1} << 32U;

/// Operations of a program. Values are those of the wire. 0 is not an operation, so that empty memory is not
/// a program.
enum class Op : uint8_t {
  set_word = 1,   ///< arg = levels of lines 0..27; ticks = duration
  loop = 2,       ///< ticks = rounds, bit 0 of arg = bit 32 of the rounds
  end_loop = 3,   //
  wait_edge = 4,  ///< arg = line | edge << 5 | abort << 7; ticks = time-out
  mark = 5,       ///< arg = id
  end = 6         ///< arg = final levels of lines 0..27
};

enum class WaitFor : uint8_t { rising = 0, falling = 1, both = 2 };

/// One packed record: u32 (op << 28 | arg), u32 ticks, little endian.
struct Record {
  uint8_t op = 0;  ///< an Op, or an unknown number
  uint32_t arg = 0;
  uint32_t ticks = 0;

  constexpr bool is(Op wanted) const { return op == static_cast<uint8_t>(wanted); }
};

constexpr Record make_record(Op op, uint32_t arg, uint32_t ticks) {
  return {static_cast<uint8_t>(op), arg & kMaxArg, ticks};
}

/// rounds: 1 to kMaxRounds.
constexpr Record make_loop(uint64_t rounds) {
  return make_record(Op::loop, static_cast<uint32_t>(rounds >> 32U), static_cast<uint32_t>(rounds));
}

constexpr uint64_t loop_rounds(const Record& record) {
  return (uint64_t{record.arg} << 32U) | record.ticks;
}

struct WaitEdge {
  uint8_t line = 0;
  WaitFor edge = WaitFor::rising;
  bool abort_on_timeout = false;
};

constexpr Record make_wait(const WaitEdge& wait, uint32_t timeout) {
  const uint32_t arg = (wait.line & 31U) | (static_cast<uint32_t>(wait.edge) << 5U) |
                       (static_cast<uint32_t>(wait.abort_on_timeout) << 7U);
  return make_record(Op::wait_edge, arg, timeout);
}

/// false: bits without a meaning are set.
constexpr bool parse_wait(uint32_t arg, WaitEdge& wait) {
  const uint32_t edge = (arg >> 5U) & 3U;
  if (edge > 2 || arg >= 256) return false;
  wait = {static_cast<uint8_t>(arg & 31U), static_cast<WaitFor>(edge), (arg & 128U) != 0};
  return true;
}

constexpr void put_record(const Record& record, uint8_t* out) {
  put_u32(out, (uint32_t{record.op} << 28U) | record.arg);
  put_u32(out + 4, record.ticks);
}

constexpr Record get_record(const uint8_t* in) {
  const uint32_t word = get_u32(in);
  return {static_cast<uint8_t>(word >> 28U), word & kMaxArg, get_u32(in + 4)};
}

/// A view of a whole program.
struct ProgramView {
  ByteView bytes;

  constexpr uint32_t size() const { return static_cast<uint32_t>(bytes.size / kRecordSize); }
  constexpr Record operator[](uint32_t index) const { return get_record(bytes.data + index * kRecordSize); }
};

}  // namespace symrig::protocol
