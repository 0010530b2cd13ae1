// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace symrig::pico {

/// Starts the 12 MHz crystal and the PLLs: clk_sys 125 MHz, clk_usb 48 MHz, 1 MHz for TIMER and watchdog.
/// Takes the peripherals in use out of reset.
void start_clocks();

}  // namespace symrig::pico
