// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/crc32c.hpp"

namespace symrig::pico {

/// A value that survives a reset, but not a loss of power. Put it into section .noinit. It has no
/// constructor: the compiler would call one at start-up and lose the value.
template <typename T>
class Kept {
 public:
  void save(const T& value) {
    __builtin_memcpy(words_, &value, sizeof value);
    words_[kWords] = check();
  }
  /// false: nothing is kept.
  bool load(T& value) const {
    if (words_[kWords] != check()) return false;
    __builtin_memcpy(&value, words_, sizeof value);
    return true;
  }
  void forget() { words_[kWords] = ~check(); }

 private:
  static constexpr uint32_t kWords = sizeof(T) / sizeof(uint32_t);
  static_assert(sizeof(T) % sizeof(uint32_t) == 0);

  uint32_t check() const {
    return protocol::crc32c({reinterpret_cast<const uint8_t*>(words_), sizeof(uint32_t) * kWords});
  }

  uint32_t words_[kWords + 1];
};

}  // namespace symrig::pico
