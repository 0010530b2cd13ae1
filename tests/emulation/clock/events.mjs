// SPDX-License-Identifier: Apache-2.0
// Events at whole cycles, on rp2040js' clock. Those that belong to the chip die with it at a reset; those of the world outside
// (stimuli, the USB bus) go on.

import { NANOSECONDS_PER_CYCLE } from './constants.mjs';

export class ChipEvent {
  constructor(clock, callback, outside) {
    this.clock = clock;
    this.alarm = clock.createAlarm(() => {
      this.pending = false;
      callback();
    });
    this.alarm.outside = outside;
    this.pending = false;
  }

  at(cycle) {
    this.pending = true;
    this.alarm.schedule(cycle * NANOSECONDS_PER_CYCLE - this.clock.nanos);
  }

  cancel() {
    this.pending = false;
    this.alarm.cancel();
  }
}

/** Takes every alarm of the chip out of the clock's list. */
export function dropChipAlarms(clock) {
  const kept = [];
  for (let alarm = clock.nextAlarm; alarm; alarm = alarm.next) if (alarm.outside) kept.push(alarm);
  kept.forEach((alarm, i) => (alarm.next = kept[i + 1] ?? null));
  clock.nextAlarm = kept[0] ?? null;
}
