// SPDX-License-Identifier: Apache-2.0
// Priorities, nesting, pending bits and sleep. Each step tells a letter; the test knows the order in which
// they must come.
#include "rp2040.hpp"

RP_RESULTS;
using namespace rp;

namespace {
volatile bool spare_pends_timer;
}

extern "C" void on_spare() {
  tell('s');
  if (spare_pends_timer) {
    reg(kNvicPend) = 1U << kIrqTimer1;  // higher priority: taken here and now
    asm volatile("dsb; isb");
    reg(kNvicPend) = 1U << kIrqGpio;  // same priority: waits
    asm volatile("dsb; isb");
  }
  tell('S');
}
extern "C" void on_timer1() {
  tell('t');
}
extern "C" void on_gpio() {
  tell('g');
}
extern "C" void on_timer0() {
  reg(kTimer + 0x34) = 1;
  tell('a');
}

namespace {

void nesting() {
  set_priority(kIrqTimer1, 0);
  set_priority(kIrqTimer0, 1);
  set_priority(kIrqSpare, 2);
  set_priority(kIrqGpio, 2);
  reg(kNvicEnable) = (1U << kIrqTimer0) | (1U << kIrqTimer1) | (1U << kIrqGpio) | (1U << kIrqSpare);
  spare_pends_timer = true;
  reg(kNvicPend) = 1U << kIrqSpare;  // s t S g
  asm volatile("dsb; isb");
  spare_pends_timer = false;
  tell('1');
}

void masked_sleep() {
  mask_irqs();
  reg(kTimer + 0x38) = 1;
  reg(kTimer + 0x10) = reg(kTimer + 0x28) + 20;
  sleep();  // ends although interrupts are masked, and takes none
  tell('w');
  unmask_irqs();  // a
  asm volatile("isb");
  tell('2');
}

void unpend() {
  mask_irqs();
  reg(kNvicPend) = 1U << kIrqSpare;
  reg(kNvicUnpend) = 1U << kIrqSpare;
  unmask_irqs();
  asm volatile("isb");
  tell('3');
}

/// A pending line that falls before it is taken stays pending.
void latched() {
  mask_irqs();
  reg(kTimer + 0x3c) = 1;  // force the line
  reg(kTimer + 0x3c) = 0;
  unmask_irqs();  // a
  asm volatile("isb");
  tell('4');
}

}  // namespace

void program() {
  start_clocks();
  results.count = 0;
  nesting();
  masked_sleep();
  unpend();
  latched();
  tell('.');
}
