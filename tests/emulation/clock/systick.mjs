// SPDX-License-Identifier: Apache-2.0
// SysTick (ARMv6-M): 24 bits, counts cycles from RVR to 0, so its period is RVR + 1. rp2040js' reloads one count early.

export class SysTick {
  constructor(chip) {
    this.chip = chip;
    this.reload = 0;
    this.control = 0;
    this.flag = false;
    this.origin = 0; // cycle at which the counter was `start`
    this.start = 0;
    this.event = chip.createEvent(() => this.reachZero());
  }

  get enabled() {
    return (this.control & 1) === 1;
  }

  /** The counter; from 0 it goes to RVR. */
  get value() {
    if (!this.enabled) return this.start;
    const passed = this.chip.cycle - this.origin;
    if (passed <= this.start) return this.start - passed;
    return this.reload - ((passed - this.start - 1) % (this.reload + 1));
  }

  setStart(value) {
    this.start = value;
    this.origin = this.chip.cycle;
    this.schedule();
  }

  schedule() {
    this.event.cancel();
    if (!this.enabled || this.reload === 0) return;
    const { value } = this;
    this.event.at(this.chip.cycle + (value > 0 ? value : this.reload + 1));
  }

  reachZero() {
    this.flag = true;
    if (this.control & 2) this.chip.pendSysTick();
    this.setStart(0);
  }

  read(offset) {
    if (offset === 0x10) {
      const word = this.control | (this.flag << 16);
      this.flag = false;
      return word;
    }
    if (offset === 0x14) return this.reload;
    if (offset === 0x18) return this.value;
    return 0xc0000000; // CALIB: no reference clock, skewed
  }

  write(offset, value) {
    if (offset === 0x10) {
      if ((value & 4) === 0 && value & 1) this.chip.fault('SysTick from the reference clock is not modelled');
      const now = this.value;
      this.control = value & 7;
      this.setStart(now);
    } else if (offset === 0x14) {
      const now = this.value;
      this.reload = value & 0xffffff;
      this.setStart(now);
    } else if (offset === 0x18) {
      this.flag = false;
      this.setStart(0);
    }
  }
}
