// SPDX-License-Identifier: Apache-2.0
#include "board_pins.hpp"
#include "symrig/firmware/version.hpp"

#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

// The image's manifest at a fixed place (0x100001c0, right after the vectors). A host finds it in a UF2 file
// without running the image. Layout: docs/board-pico-debug.md, "Image".

namespace symrig::pico {
namespace {

struct Manifest {
  char magic[8];
  uint32_t layout;
  uint32_t reserved;
  uint64_t firmware_hash;
  char board[16];
  char version[16];
};
static_assert(sizeof(Manifest) == 56);

constexpr Manifest make() {
  Manifest made{{'S', 'Y', 'M', 'R', 'I', 'G', 'F', 'W'}, 1, 0, firmware::kSourceHash, {}, {}};
  for (uint32_t i = 0; i + 1 < sizeof made.board && kBoardName[i] != 0; ++i) made.board[i] = kBoardName[i];
  for (uint32_t i = 0; i + 1 < sizeof made.version && firmware::kVersion[i] != 0; ++i)
    made.version[i] = firmware::kVersion[i];
  return made;
}

__attribute__((section(".manifest"), used)) constexpr Manifest kManifest = make();

}  // namespace
}  // namespace symrig::pico

// What `picotool info` tells about the image: a header within the first 256 bytes after boot2, and a list of
// entries in flash (pico-sdk, binary_info/structure.h: the numbers).

extern "C" {
extern const uint32_t __info_start, __info_end, __flash_end;  // NOLINT
}

namespace symrig::pico {
namespace {

#define SYMRIG_INFO(part) __attribute__((section(".info." part), used))

constexpr uint16_t kTag = 'R' | 'P' << 8U;

struct Text {
  uint16_t type;  // 6: id and string
  uint16_t tag;
  uint32_t id;
  const char* value;
};
struct Number {
  uint16_t type;  // 5: id and number
  uint16_t tag;
  uint32_t id;
  const void* value;
};
struct Pins {
  uint16_t type;  // 9: mask of pins, and their names with '|' between them
  uint16_t tag;
  uint32_t mask;
  const char* names;
};

SYMRIG_INFO("text") const char name_text[] = "symrig trigger board";
SYMRIG_INFO("text") const char board_text[] = "pico";
SYMRIG_INFO("text") const char boot2_text[] = "symrig quad read";

/// A copy in this section: the original is among the data that start-up copies to RAM.
template <uint32_t kSize>
struct Copy {
  char text[kSize];
};
template <uint32_t kSize>
constexpr Copy<kSize> copy(const char* from) {
  Copy<kSize> made{};
  for (uint32_t i = 0; i + 1 < kSize && from[i] != 0; ++i) made.text[i] = from[i];
  return made;
}
SYMRIG_INFO("text") constexpr auto kVersionText = copy<24>(firmware::kVersion);
SYMRIG_INFO("text") constexpr auto kPinText = copy<sizeof kPinNames>(kPinNames);

SYMRIG_INFO("entry") const Text name{6, kTag, 0x02031c86, name_text};
SYMRIG_INFO("entry") const Text version{6, kTag, 0x11a9bc3a, kVersionText.text};
SYMRIG_INFO("entry") const Text board{6, kTag, 0xb63cffbb, board_text};
SYMRIG_INFO("entry") const Text boot2{6, kTag, 0x7f8882e1, boot2_text};
SYMRIG_INFO("entry") const Number end{5, kTag, 0x68f465de, &__flash_end};
SYMRIG_INFO("entry") const Pins pins{9, kTag, kPinMask, kPinText.text};

SYMRIG_INFO("list") const void* const entries[] = {&name, &version, &board, &boot2, &end, &pins};
/// Start of each piece that start-up copies to RAM; all entries are in flash, so none is needed.
SYMRIG_INFO("entry") const uint32_t no_copies[] = {0};

struct Header {
  uint32_t begin;
  const void* first;
  const void* last;
  const void* copies;
  uint32_t end;
};
__attribute__((section(".info_header"), used))
const Header header{0x7188ebf2, &__info_start, &__info_end, no_copies, 0xe71aa390};

}  // namespace
}  // namespace symrig::pico
