// SPDX-License-Identifier: Apache-2.0
// From reset to program(), and the vector table: an image overrides the handlers it needs.
#include "rp2040.hpp"

extern "C" {
extern rp::u32 data_begin, data_end, data_load, bss_begin, bss_end, stack_top;
void unexpected() {
  for (;;) asm volatile("bkpt 1");
}
#define HANDLER(name) void name() __attribute__((weak, nothrow, alias("unexpected")))
HANDLER(on_systick);
HANDLER(on_timer0);
HANDLER(on_timer1);
HANDLER(on_usb);
HANDLER(on_gpio);
HANDLER(on_spare);
}

void program();

extern "C" [[noreturn]] void reset() {
  const rp::u32* from = &data_load;
  for (rp::u32* to = &data_begin; to < &data_end;) *to++ = *from++;
  for (rp::u32* to = &bss_begin; to < &bss_end;) *to++ = 0;
  program();
  for (;;) asm volatile("wfi");
}

using Handler = void (*)();
extern const Handler vectors[48];
__attribute__((section(".vectors"), used)) const Handler vectors[48] = {reinterpret_cast<Handler>(&stack_top),
                                                                        reset,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        on_systick,
                                                                        on_timer0,
                                                                        on_timer1,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        on_usb,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        on_gpio,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        on_spare,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected,
                                                                        unexpected};
