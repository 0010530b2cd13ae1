// SPDX-License-Identifier: Apache-2.0
#include "abort_scan.hpp"

#include "registers.hpp"
#include "symrig/protocol/frame.hpp"
#include "symrig/protocol/messages.hpp"

namespace symrig::pico {
namespace {

constexpr size_t kBody = 2;  // the tag of an empty message and its length
constexpr size_t kPlain = protocol::kHeaderSize + kBody + protocol::kCrcSize;
constexpr size_t kWire = kPlain + 2;  // COBS adds one byte to so short a frame, and a zero closes it
constexpr uint8_t kAbortTag = symrig_wire_Request_abort_tag << 3U | 2U;

/// COBS of exactly kPlain bytes. false: it is something else.
SYMRIG_RAM bool decode(const uint8_t* wire, uint8_t (&plain)[kPlain]) {
  size_t block_end = 0;
  for (size_t i = 0; i <= kPlain; ++i) {
    if (wire[i] == 0) return false;
    if (i != block_end) {
      plain[i - 1] = wire[i];
      continue;
    }
    if (i > 0) plain[i - 1] = 0;
    block_end = i + wire[i];
  }
  return block_end == kPlain + 1;
}

}  // namespace

SYMRIG_RAM bool ends_with_abort(const uint8_t* bytes, size_t size) {
  if (size < kWire || bytes[size - 1] != 0) return false;
  if (size > kWire && bytes[size - kWire - 1] != 0) return false;  // a longer frame
  uint8_t plain[kPlain];
  if (!decode(bytes + size - kWire, plain)) return false;
  const bool is_abort = plain[1] == static_cast<uint8_t>(protocol::Kind::request) &&
                        (plain[7] & protocol::flag::urgent) != 0 &&
                        plain[protocol::kHeaderSize] == kAbortTag && plain[protocol::kHeaderSize + 1] == 0;
  if (!is_abort) return false;
  constexpr size_t covered = kPlain - protocol::kCrcSize;
  return protocol::crc32c({plain, covered}) == protocol::get_u32(plain + covered);
}

}  // namespace symrig::pico
