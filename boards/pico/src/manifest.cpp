// SPDX-License-Identifier: Apache-2.0
// The image's manifest at a fixed place (0x100001c0, right after the vectors). A host finds it in a UF2 file
// without running the image. Layout: docs/board-pico-debug.md, "Image".
#include "board_pins.hpp"
#include "symrig/firmware/version.hpp"

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
