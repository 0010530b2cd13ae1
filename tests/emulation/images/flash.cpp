// SPDX-License-Identifier: Apache-2.0
// Writes a page of flash through the ROM's functions, as a firmware that keeps settings does, then reads it
// back.
#include "rp2040.hpp"

RP_RESULTS;
using namespace rp;

namespace {

constexpr u32 kSector = 0x1f0000;

using LookUp = void* (*)(u16* table, u32 code);
using Plain = void (*)();
using Erase = void (*)(u32 offset, u32 count, u32 block, u8 command);
using Program = void (*)(u32 offset, const u8* data, u32 count);

constexpr u32 code(char a, char b) {
  return static_cast<u32>(a) | (static_cast<u32>(b) << 8);
}

template <typename Function>
Function rom(char a, char b) {
  const auto table = reinterpret_cast<u16*>(static_cast<u32>(*reinterpret_cast<volatile u16*>(0x14)));
  const auto look_up = reinterpret_cast<LookUp>(static_cast<u32>(*reinterpret_cast<volatile u16*>(0x18)));
  return reinterpret_cast<Function>(look_up(table, code(a, b)));
}

struct Functions {
  Plain connect, exit_xip, flush, enter_xip;
  Erase erase;
  Program program;
};

u8 page[256];

__attribute__((section(".inram"), noinline)) void write_page(const Functions& rom_functions) {
  rom_functions.connect();
  rom_functions.exit_xip();
  rom_functions.erase(kSector, 4096, 65536, 0xd8);
  rom_functions.program(kSector, page, sizeof page);
  rom_functions.flush();
  rom_functions.enter_xip();
}

}  // namespace

void program() {
  start_clocks();
  results.count = 0;
  const Functions functions = {rom<Plain>('I', 'F'), rom<Plain>('E', 'X'), rom<Plain>('F', 'C'),
                               rom<Plain>('C', 'X'), rom<Erase>('R', 'E'), rom<Program>('R', 'P')};
  for (u32 i = 0; i < sizeof page; ++i) page[i] = static_cast<u8>(3 * i);
  tell(reinterpret_cast<u32>(rom<Plain>('?', '?')));
  tell(rom<u32 (*)(u32)>('P', '3')(0xf0f0));
  mask_irqs();
  const u32 begin = reg(kTimer + 0x28);
  write_page(functions);
  tell(reg(kTimer + 0x28) - begin);
  unmask_irqs();
  tell(reg(0x10000000 + kSector));
  tell(reg(0x10000000 + kSector + 252));
  tell(reg(0x10000000 + kSector + 256));
  const auto reboot = rom<void (*)(u32, u32)>('U', 'B');
  reboot(1U << 25, 0);
}
