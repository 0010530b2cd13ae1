// SPDX-License-Identifier: Apache-2.0
// From the reset vector to main(): clocks, then copies code and data to RAM, clears bss, runs constructors.
// Also the vector tables.
#include "chip.hpp"
#include "registers.hpp"

extern "C" {
extern uint32_t __data_start, __data_end, __data_load, __bss_start, __bss_end, __stack_top;  // NOLINT
extern void (*__init_start[])();                                                             // NOLINT
extern void (*__init_end[])();                                                               // NOLINT

int main();
void usb_handler();
void gpio_handler();
void pio0_handler();
void dma0_handler();
void timer0_handler();
void timer1_handler();

[[noreturn]] void reset_handler();
void crash_handler();
void systick_handler();
[[noreturn]] void early_crash_handler();
[[noreturn]] void begin_in_ram();
}

namespace {

using Handler = void (*)();

struct FirstVectors {
  uint32_t* stack;
  Handler system[15];
};
struct Vectors {
  uint32_t* stack;
  Handler system[15];
  Handler irq[32];
};

// In RAM, because the processor reads an entry at each interrupt. VTOR needs 256 bytes of alignment.
__attribute__((section(".ramvectors"), used, aligned(256))) const Vectors kVectors = {
    &__stack_top,
    {reset_handler, crash_handler, crash_handler, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr,
     nullptr, crash_handler, nullptr, nullptr, crash_handler, systick_handler},
    {timer0_handler, timer1_handler, crash_handler, crash_handler, crash_handler, usb_handler,
     crash_handler,  pio0_handler,   crash_handler, crash_handler, crash_handler, dma0_handler,
     crash_handler,  gpio_handler,   crash_handler, crash_handler, crash_handler, crash_handler,
     crash_handler,  crash_handler,  crash_handler, crash_handler, crash_handler, crash_handler,
     crash_handler,  crash_handler,  crash_handler, crash_handler, crash_handler, crash_handler,
     crash_handler,  crash_handler}};

// For the boot ROM, and until the other table is there.
__attribute__((section(".vectors"), used))
const FirstVectors kFirstVectors = {&__stack_top, {reset_handler, early_crash_handler, early_crash_handler}};

}  // namespace

extern "C" {

/// Before the code is in RAM. The watchdog is off, and all pins are as after a reset.
[[noreturn]] SYMRIG_FLASH void early_crash_handler() {
  for (;;) asm volatile("");
}

/// A processor fault or an unexpected interrupt. The stack may be the reason, so this uses another one.
__attribute__((naked)) void crash_handler() {
  asm volatile(
      "mov  r0, sp\n"
      "mrs  r1, ipsr\n"
      "ldr  r2, =__crash_stack_top\n"
      "mov  sp, r2\n"
      "ldr  r2, =end_in_crash\n"
      "bx   r2\n"
      ".ltorg\n");
}

/// Not on top of the program's stack. So check_stack.py does not count it.
[[noreturn]] __attribute__((used)) void end_in_crash(const symrig::pico::ExceptionFrame* frame,
                                                     uint32_t exception) {
  symrig::pico::release_pins();
  symrig::pico::keep_crash(*frame, exception);
  symrig::pico::stop_board();
}

/// Passes the interrupted program's registers on.
__attribute__((naked)) void systick_handler() {
  asm volatile(
      "mov  r0, sp\n"
      "ldr  r1, =systick_body\n"
      "bx   r1\n"
      ".ltorg\n");
}

[[noreturn]] SYMRIG_FLASH void reset_handler() {
  symrig::pico::start_clocks();  // first, because copying takes ten times as long without it
  const uint32_t* from = &__data_load;
  for (uint32_t* to = &__data_start; to < &__data_end;) *to++ = *from++;
  begin_in_ram();
}

[[noreturn]] SYMRIG_RAM void begin_in_ram() {
  symrig::pico::reg(symrig::pico::core::vtor) = symrig::pico::address_of(&kVectors);
  symrig::pico::fill_stack();
  symrig::pico::guard_stack();
  for (uint32_t* to = &__bss_start; to < &__bss_end;) *to++ = 0;
  for (auto* init = __init_start; init < __init_end; ++init) (*init)();
  main();
  symrig::pico::stop_board();
}

/// Never called, but compilers refer to it.
[[noreturn]] void __cxa_pure_virtual() {  // NOLINT(bugprone-reserved-identifier)
  symrig::pico::stop_board();
}
}
