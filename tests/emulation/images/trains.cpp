// SPDX-License-Identifier: Apache-2.0
// Pulse trains from a table in RAM by DMA, round and round, on GPIO2 and GPIO3, while the processor computes,
// is interrupted every 100 us, and answers each rising edge of GPIO6 on GPIO7.
#include "rp2040.hpp"

RP_RESULTS;
using namespace rp;

namespace {

constexpr u32 kDma = 0x50000000;
constexpr u32 kPio0 = 0x50200000;
// .side_set 1:  out x,32 side 0 / out y,32 side 0 / jmp x-- . side 0 / jmp y-- . side 1: low is x + 3 cycles,
// high y + 1
constexpr u16 kProgram[] = {0x6020, 0x6040, 0x0042, 0x1083};
constexpr u32 kWords = 64;
constexpr u32 kRing = (8U << 6);  // 256 bytes, on the read side

alignas(256) u32 table[2][kWords];

void start_machine(u32 machine, u32 pin) {
  const u32 base = kPio0 + 0xc8 + 0x18 * machine;
  reg(base) = 1U << 16;
  reg(base + 4) = 3U << 12;
  reg(base + 8) = (1U << 17) | (1U << 19) | (1U << 30);  // autopull, to the right, one FIFO of eight
  reg(base + 20) = (1U << 29) | (1U << 26) | (pin << 10) | (pin << 5);
  reg(base + 16) = 0xe081;  // set pindirs, 1
  reg(kIoBank0 + 8 * pin + 4) = 6;
}

void start_channel(u32 channel) {
  const u32 base = kDma + 0x40 * channel;
  reg(base) = reinterpret_cast<u32>(table[channel]);
  reg(base + 4) = kPio0 + 0x10 + 4 * channel;
  reg(base + 8) = 0xffffffff;
  reg(base + 12) = 1 | (2U << 2) | (1U << 4) | kRing | (channel << 11) | (channel << 15) | (1U << 21);
}

}  // namespace

extern "C" void on_gpio() {
  set_high(7);
  reg(kIoBank0 + 0xf0) = 8U << 24;
  set_low(7);
}

extern "C" void on_timer0() {
  reg(kTimer + 0x34) = 1;
  reg(kTimer + 0x10) = reg(kTimer + 0x10) + 100;
  tell(0);
  results.count = 1;
}

void program() {
  start_clocks();
  release((1U << 2) | (1U << 10));
  results.count = 0;
  for (u32 i = 0; i < kWords; i += 2) {
    table[0][i] = 40 + i;     // low
    table[0][i + 1] = i / 2;  // high: 1 to 32 cycles
    table[1][i] = 300;
    table[1][i + 1] = 3 * i;
  }
  for (u32 i = 0; i < 4; ++i) reg(kPio0 + 0x48 + 4 * i) = kProgram[i];
  for (u32 i = 0; i < 2; ++i) {
    start_machine(i, 2 + i);
    start_channel(i);
  }
  sio_output(7);
  reg(kIoBank0 + 0x100) = 8U << 24;  // rising edges of GPIO6
  reg(kTimer + 0x38) = 1;
  reg(kTimer + 0x10) = reg(kTimer + 0x28) + 100;
  set_priority(kIrqGpio, 1);
  set_priority(kIrqTimer0, 2);
  enable_irq(kIrqGpio);
  enable_irq(kIrqTimer0);
  reg(kPio0) = 3;
  for (volatile u32 i = 0;;) i = 3 * i + 1;
}
