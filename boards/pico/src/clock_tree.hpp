// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace symrig::pico {

/// Crystal 12 MHz -> PLL -> clk_sys 125 MHz, clk_usb 48 MHz; 1 MHz for TIMER and watchdog; takes the
/// peripherals in use out of reset.
void start_clocks();

}  // namespace symrig::pico
