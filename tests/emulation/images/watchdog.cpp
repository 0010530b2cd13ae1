// SPDX-License-Identifier: Apache-2.0
// Counts its lives in a scratch register and in SRAM; the first two end by the watchdog, the third asks for a
// reset, the fourth stays.
#include "rp2040.hpp"

RP_RESULTS;
using namespace rp;

void program() {
  start_clocks();
  const u32 life = reg(kWatchdog + 8) == 0 ? 0 : reg(kWatchdog + 0x0c);
  if (life == 0) results.count = 0;
  reg(kWatchdog + 0x0c) = life + 1;
  tell(reg(kWatchdog + 8));         // why it was reset
  tell(reg(kResets));               // blocks are in reset again
  tell(reg(kTimer + 0x28) < 1000);  // TIMER began at 0
  sio_output(3);
  set_high(3);
  reg(kPsm + 8) = 0x1ffff & ~3U;  // all but the oscillators
  if (life >= 3) return;
  if (life == 2) reg(kWatchdog) = 1U << 31;
  reg(kWatchdog + 4) = 2 * 500;  // 500 us; two counts a microsecond
  reg(kWatchdog) = 1U << 30;
  for (;;) {
  }
}
