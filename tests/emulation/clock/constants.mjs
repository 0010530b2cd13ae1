// SPDX-License-Identifier: Apache-2.0
// One cycle is 8 ns: clk_sys is 125 MHz. All times of the emulation are whole cycles since power-up.

export const NANOSECONDS_PER_CYCLE = 8;
export const CYCLES_PER_MICROSECOND = 125;
export const CYCLES_PER_MILLISECOND = 125_000;
export const CLOCK_HZ = 125_000_000;
