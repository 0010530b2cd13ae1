// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stddef.h>  // NOLINT(modernize-deprecated-headers)
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::pico {

/// Bytes between an interrupt and the main loop: one side writes, the other reads. The size is a power of
/// two.
template <size_t kSize>
class ByteRing {
  static_assert((kSize & (kSize - 1)) == 0);

 public:
  size_t used() const { return put_ - taken_; }
  size_t room() const { return kSize - used(); }
  void put(uint8_t byte) {
    bytes_[put_ % kSize] = byte;
    put_ = put_ + 1;
  }
  uint8_t take() {
    const uint8_t byte = bytes_[taken_ % kSize];
    taken_ = taken_ + 1;
    return byte;
  }
  /// For the reader: discards everything.
  void clear() { taken_ = put_; }
  /// For the writer: a position for drop_to().
  size_t mark() const { return put_; }
  /// For the reader: true if everything written before `mark` was taken.
  bool taken_up_to(size_t mark) const { return static_cast<ptrdiff_t>(taken_ - mark) >= 0; }
  /// For the reader: discards what was written before `mark`.
  void drop_to(size_t mark) {
    if (static_cast<ptrdiff_t>(mark - taken_) > 0) taken_ = mark;
  }

 private:
  uint8_t bytes_[kSize];
  volatile size_t put_ = 0;
  volatile size_t taken_ = 0;
};

}  // namespace symrig::pico
