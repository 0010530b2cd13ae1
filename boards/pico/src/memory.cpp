// SPDX-License-Identifier: Apache-2.0
// memcpy and memset by words. The C library's small versions work by bytes, which costs about 800 cycles per
// event.
#include "registers.hpp"

#include <stddef.h>  // NOLINT(modernize-deprecated-headers): there is no <cstddef> here
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace {

constexpr uintptr_t kWordMask = sizeof(uint32_t) - 1;

/// Words that may read and write objects of any type.
using Word = uint32_t __attribute__((may_alias));

uintptr_t address(const void* at) {
  return reinterpret_cast<uintptr_t>(at);
}

}  // namespace

extern "C" {

SYMRIG_RAM void* memcpy(void* __restrict to, const void* __restrict from, size_t size) {
  auto* out = static_cast<uint8_t*>(to);
  const auto* in = static_cast<const uint8_t*>(from);
  if (((address(out) | address(in)) & kWordMask) == 0) {
    for (; size >= sizeof(Word); size -= sizeof(Word), out += sizeof(Word), in += sizeof(Word))
      *reinterpret_cast<Word*>(out) = *reinterpret_cast<const Word*>(in);
  }
  for (; size > 0; --size) *out++ = *in++;
  return to;
}

SYMRIG_RAM void* memset(void* to, int value, size_t size) {
  auto* out = static_cast<uint8_t*>(to);
  const auto byte = static_cast<uint8_t>(value);
  for (; size > 0 && (address(out) & kWordMask) != 0; --size) *out++ = byte;
  const Word word = byte * 0x01010101U;
  for (; size >= sizeof(Word); size -= sizeof(Word), out += sizeof(Word))
    *reinterpret_cast<Word*>(out) = word;
  for (; size > 0; --size) *out++ = byte;
  return to;
}

}  // extern "C"
