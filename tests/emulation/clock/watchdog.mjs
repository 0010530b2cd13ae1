// SPDX-License-Identifier: Apache-2.0
// WATCHDOG (RP2040 data sheet, 4.7): a countdown that resets the chip once, scratch registers that outlive it, and the
// tick that TIMER counts. The counter falls by two each tick (erratum RP2040-E1): 2 counts are one microsecond.

import { CYCLES_PER_MICROSECOND } from './constants.mjs';

const COUNTS_PER_MICROSECOND = 2;
const TICK_DIVIDER = 12; // clk_ref cycles a tick: 12 MHz crystal, 1 us
const REASON_TIMER = 1;
const REASON_FORCE = 2;

export class Watchdog {
  /** `survivor`: {scratch, reason} of the life before a reset. */
  constructor(chip, survivor) {
    this.chip = chip;
    this.scratch = survivor?.scratch ?? new Uint32Array(8);
    this.reason = survivor?.reason ?? 0;
    this.count = 0;
    this.loadedAt = 0;
    this.enabled = false;
    this.pause = 7;
    this.tick = 0;
    this.event = chip.createEvent(() => this.fire(REASON_TIMER));
  }

  get ticking() {
    return ((this.tick >>> 9) & 1) === 1 && !this.stopped;
  }

  /** The crystal has stopped, and with it the tick: nothing counts any more. A reset by FORCE still works. */
  stopTick() {
    const { remaining } = this;
    this.stopped = true;
    this.load(remaining);
  }

  get running() {
    return this.enabled && this.ticking;
  }

  get remaining() {
    if (!this.running) return this.count;
    const micros = (this.chip.cycle - this.loadedAt) / CYCLES_PER_MICROSECOND;
    return Math.max(0, this.count - COUNTS_PER_MICROSECOND * Math.floor(micros));
  }

  load(count) {
    this.count = count;
    this.loadedAt = this.chip.cycle;
    this.event.cancel();
    if (!this.running) return;
    const cycles = Math.ceil(count / COUNTS_PER_MICROSECOND) * CYCLES_PER_MICROSECOND;
    this.event.at(this.chip.cycle + Math.max(1, cycles));
  }

  fire(reason) {
    this.chip.requestReset({ scratch: this.scratch, reason });
  }

  readUint32(offset) {
    if (offset === 0x00) return this.remaining | (this.pause << 24) | (this.enabled << 30);
    if (offset === 0x08) return this.reason;
    if (offset >= 0x0c && offset <= 0x28) return this.scratch[(offset - 0x0c) >>> 2];
    if (offset === 0x2c) return this.tick | (this.ticking ? 1 << 10 : 0);
    return 0;
  }

  writeUint32Atomic(offset, value, alias) {
    const before = alias ? this.readUint32(offset) : 0;
    this.write(offset, [value, before ^ value, before | value, before & ~value][alias] >>> 0);
  }

  write(offset, value) {
    if (offset === 0x00) this.writeControl(value);
    else if (offset === 0x04) this.load(value & 0xffffff);
    else if (offset >= 0x0c && offset <= 0x28) this.scratch[(offset - 0x0c) >>> 2] = value;
    else if (offset === 0x2c) this.writeTick(value);
  }

  writeControl(value) {
    const remaining = this.remaining;
    this.pause = (value >>> 24) & 7;
    this.enabled = ((value >>> 30) & 1) === 1;
    this.load(remaining);
    if (value >>> 31) this.fire(REASON_FORCE);
  }

  writeTick(value) {
    const remaining = this.remaining;
    this.tick = value & 0x3ff & ~(1 << 10);
    if (this.ticking && (this.tick & 0x1ff) !== TICK_DIVIDER) {
      this.chip.fault(`the watchdog's tick divider is ${this.tick & 0x1ff}; a microsecond takes ${TICK_DIVIDER}`);
    }
    this.chip.timer.setTicking(this.ticking);
    this.load(remaining);
  }
}
