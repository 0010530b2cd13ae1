// SPDX-License-Identifier: Apache-2.0
#include "edge_program.hpp"

namespace symrig::pico::edge_machine {

SYMRIG_RAM void write_count_down(uint32_t reference, uint32_t count) {
  uint32_t passed = 0;
  asm volatile(
      "ldr  %[passed], [%[systick]]\n"
      "subs %[passed], %[reference], %[passed]\n"
      "lsls %[passed], %[passed], #8\n"
      "lsrs %[passed], %[passed], #8\n"
      "subs %[passed], %[count], %[passed]\n"
      "str  %[passed], [%[queue]]\n"
      : [passed] "=&l"(passed)
      : [systick] "l"(core::systick), [reference] "l"(reference), [count] "l"(count),
        [queue] "l"(pio::pio0 + pio::txf0)
      : "cc", "memory");
}

SYMRIG_RAM uint32_t enable_timed() {
  uint32_t stood = 0;
  asm volatile(
      "ldr %[stood], [%[systick]]\n"
      "str %[enable], [%[control]]\n"
      : [stood] "=&l"(stood)
      : [systick] "l"(core::systick), [control] "l"(pio::pio0 + pio::ctrl), [enable] "l"(1)
      : "memory");
  return stood;
}

}  // namespace symrig::pico::edge_machine
