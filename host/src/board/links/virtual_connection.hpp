// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/internal/byte_stream.hpp"
#include "symrig/board/virtual_bench.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig::board {

/// Writes little-endian numbers one after another: the payloads of the virtual link.
class Packer {
 public:
  template <class T>
  Packer& put(T value) {
    for (std::size_t k = 0; k < sizeof(T); ++k)
      bytes_.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * k)));
    return *this;
  }
  std::span<const std::uint8_t> bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// The number that begins at `offset`. The caller has checked that the bytes suffice.
template <class T>
T unpack(std::span<const std::uint8_t> bytes, std::size_t offset) {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < sizeof(T); ++k) value |= std::uint64_t{bytes[offset + k]} << (8 * k);
  return static_cast<T>(value);
}

}  // namespace symrig::board

namespace symrig {

/// Requests and answers of the virtual link: u8 type, u32 length, payload. Each request has one answer, in
/// order.
class VirtualBench::Connection {
 public:
  explicit Connection(base::ByteStream stream) : stream_(std::move(stream)) {}

  /// The payload of the answer, which has at least `least` bytes. fails: device_lost (no answer, connection
  /// closed, or the server's own reason), protocol.
  /// board_time: how long the board runs for this request. After one missing answer all further calls fail.
  Result<std::vector<std::uint8_t>> ask(char type, std::span<const std::uint8_t> payload, std::size_t least,
                                        Nanoseconds board_time = Nanoseconds{0});
  /// A request whose answer has no payload.
  Result<void> tell(char type, std::span<const std::uint8_t> payload,
                    Nanoseconds board_time = Nanoseconds{0});

 private:
  Result<void> fill(std::size_t count, Nanoseconds patience);
  Error silence(Nanoseconds patience) const;

  base::ByteStream stream_;
  std::vector<std::uint8_t> waiting_;
  bool silent_ = false;
};

}  // namespace symrig
