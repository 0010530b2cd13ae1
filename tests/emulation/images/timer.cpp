// SPDX-License-Identifier: Apache-2.0
// An alarm every 50 us on an absolute schedule toggles GPIO2, SysTick every 1000 cycles GPIO4, beside a busy
// loop that takes stamps.
#include "rp2040.hpp"

RP_RESULTS;
using namespace rp;

namespace {
volatile u32 due;
volatile u32 fired;
}  // namespace

extern "C" void on_timer0() {
  toggle(2);
  reg(kTimer + 0x34) = 1;
  due = due + 50;
  reg(kTimer + 0x10) = due;
  fired = fired + 1;
}

extern "C" void on_systick() {
  toggle(4);
}

void program() {
  start_clocks();
  results.count = 0;
  sio_output(2);
  sio_output(4);
  reg(kSysTick + 4) = 999;
  reg(kSysTick + 8) = 0;
  reg(kSysTick) = 7;
  reg(kTimer + 0x38) = 1;
  enable_irq(kIrqTimer0);
  due = reg(kTimer + 0x28) + 100;
  reg(kTimer + 0x10) = due;
  while (fired < 200) {
    if ((reg(kTimer + 0x28) & 0x3ff) == 0 && results.count < 100) tell(reg(kSysTick + 8));
  }
  reg(kTimer + 0x38) = 0;
  reg(kSysTick) = 0;
}
