// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/frame.hpp"

namespace symrig::firmware {

/// Finds an urgent abort in the bytes from the host before the core handles them. It runs in the interrupt in
/// which the bytes arrive, so that outputs are safe even if the main loop is busy. The core handles the same
/// bytes later.
///
/// It is fast enough for an interrupt: an abort is one short frame of a known size, so it stores no longer
/// frames. It computes the CRC byte by byte, and only of frames that may be an abort. All at once would take
/// a Mega 100 us, in which it cannot see an interlock.
class UrgentScan {
 public:
  /// true: this byte completes a valid urgent abort.
  bool push(uint8_t byte) {
    if (byte == 0) return finish();
    if (left_ == 0) {
      // A new block of COBS: the block before it represents a zero at its end, unless it was a full block.
      if (zero_owed_) store(0);
      zero_owed_ = byte != 0xFF;
      left_ = static_cast<uint8_t>(byte - 1);
      return false;
    }
    --left_;
    store(byte);
    return false;
  }
  /// The host disconnected: discards a partial frame.
  void restart() {
    size_ = 0;
    left_ = 0;
    zero_owed_ = false;
    crc_ = {};
  }

 private:
  static constexpr size_t kKindAt = 1;
  static constexpr size_t kBody = 2;
  static constexpr size_t kCovered = protocol::kHeaderSize + kBody;
  static constexpr size_t kSize = kCovered + protocol::kCrcSize;

  void store(uint8_t byte) {
    if (size_ < kSize) plain_[size_] = byte;
    if (size_ < kCovered && (size_ < kKindAt || is_request())) crc_.add(byte);
    if (size_ <= kSize) ++size_;
  }

  bool finish() {
    const bool found =
        size_ == kSize && left_ == 0 && is_abort() && crc_.value() == protocol::get_u32(plain_ + kCovered);
    restart();
    return found;
  }

  bool is_request() const { return plain_[kKindAt] == static_cast<uint8_t>(protocol::Kind::request); }

  /// Request{abort{}} in the form that every encoder writes: field 10, length-delimited, empty.
  bool is_abort() const {
    const uint8_t flags = plain_[7];
    const bool urgent = (flags & protocol::flag::urgent) != 0;
    const bool sync = (flags & protocol::flag::sync) != 0;
    const uint8_t* body = plain_ + protocol::kHeaderSize;
    return is_request() && urgent && !sync && body[0] == (10U << 3U | 2U) && body[1] == 0;
  }

  uint8_t plain_[kSize] = {};
  size_t size_ = 0;         // kSize + 1: too long
  protocol::Crc32c crc_;    // of what is covered, so far
  uint8_t left_ = 0;        // bytes that are missing in this block
  bool zero_owed_ = false;  // the last block represents a zero at its end, if another block follows
};

}  // namespace symrig::firmware
