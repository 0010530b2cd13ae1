// SPDX-License-Identifier: Apache-2.0
// TIMER: 64 bits of microseconds and four alarms, exact to the cycle (RP2040 data sheet, 4.6).
// It counts the watchdog's tick, so it stands still until that is enabled. An alarm compares 32 bits: one set in the past
// fires after 2^32 us, as on silicon.

import { CYCLES_PER_MICROSECOND } from './time.mjs';

const WORD = 2 ** 32;

export class Timer {
  constructor(chip) {
    this.chip = chip;
    this.alarms = [0, 1, 2, 3].map((i) => ({
      target: 0,
      armed: false,
      event: chip.createEvent(() => this.fire(i)),
    }));
    this.reset();
  }

  reset() {
    Object.assign(this, { heldMicros: 0, origin: 0, running: this.ticking ?? false, paused: false });
    Object.assign(this, { raw: 0, enabled: 0, forced: 0, latchedHigh: 0, writtenLow: 0, debugPause: 7 });
    this.origin = this.chip.cycle;
    for (const alarm of this.alarms) this.disarm(alarm);
    this.updateLines();
  }

  get micros() {
    if (!this.running) return this.heldMicros;
    return this.heldMicros + Math.floor((this.chip.cycle - this.origin) / CYCLES_PER_MICROSECOND);
  }

  /** The watchdog's tick generator started or stopped. */
  setTicking(ticking) {
    this.ticking = ticking;
    this.setRunning();
  }

  setRunning() {
    const running = Boolean(this.ticking) && !this.paused;
    if (running === this.running) return;
    this.setTime(this.micros);
    this.running = running;
    this.rescheduleAll();
  }

  setTime(micros) {
    this.heldMicros = micros;
    this.origin = this.chip.cycle;
  }

  rescheduleAll() {
    for (const alarm of this.alarms) if (alarm.armed) this.schedule(alarm);
  }

  schedule(alarm) {
    alarm.event.cancel();
    if (!this.running) return;
    const ahead = (alarm.target - (this.micros % WORD) + WORD) % WORD;
    const due = this.micros - this.heldMicros + ahead;
    alarm.event.at(Math.max(this.origin + due * CYCLES_PER_MICROSECOND, this.chip.cycle + 1));
  }

  disarm(alarm) {
    alarm.armed = false;
    alarm.event.cancel();
  }

  fire(index) {
    this.disarm(this.alarms[index]);
    this.raw |= 1 << index;
    this.updateLines();
  }

  get status() {
    return (this.raw & this.enabled) | this.forced;
  }

  updateLines() {
    for (let i = 0; i < 4; i++) this.chip.setInterrupt(i, ((this.status >>> i) & 1) === 1);
  }

  readUint32(offset) {
    const micros = this.micros;
    switch (offset) {
      case 0x08:
        return this.latchedHigh;
      case 0x0c:
        this.latchedHigh = Math.floor(micros / WORD);
        return micros % WORD;
      case 0x10:
      case 0x14:
      case 0x18:
      case 0x1c:
        return this.alarms[(offset - 0x10) >>> 2].target;
      case 0x20:
        return this.alarms.reduce((word, alarm, i) => word | (alarm.armed << i), 0);
      case 0x24:
        return Math.floor(micros / WORD);
      case 0x28:
        return micros % WORD;
      case 0x2c:
        return this.debugPause;
      case 0x30:
        return +this.paused;
      case 0x34:
        return this.raw;
      case 0x38:
        return this.enabled;
      case 0x3c:
        return this.forced;
      case 0x40:
        return this.status;
      default:
        return 0;
    }
  }

  writeUint32Atomic(offset, value, alias) {
    const before = alias ? this.readUint32(offset) : 0;
    this.write(offset, [value, before ^ value, before | value, before & ~value][alias] >>> 0, value >>> 0);
  }

  write(offset, value, raw) {
    if (offset >= 0x10 && offset <= 0x1c) return this.setAlarm(this.alarms[(offset - 0x10) >>> 2], value);
    switch (offset) {
      case 0x00:
        this.setTime(value * WORD + this.writtenLow);
        return this.rescheduleAll();
      case 0x04:
        this.writtenLow = value;
        return undefined;
      case 0x20:
        this.alarms.forEach((alarm, i) => (raw >>> i) & 1 && this.disarm(alarm));
        return undefined;
      case 0x2c:
        this.debugPause = value & 7;
        return undefined;
      case 0x30:
        this.paused = (value & 1) === 1;
        return this.setRunning();
      case 0x34:
        this.raw &= ~raw;
        break;
      case 0x38:
        this.enabled = value & 15;
        break;
      case 0x3c:
        this.forced = value & 15;
        break;
      default:
        return this.chip.fault(`TIMER: a write at offset 0x${offset.toString(16)} is not modelled`);
    }
    return this.updateLines();
  }

  setAlarm(alarm, value) {
    alarm.target = value;
    alarm.armed = true;
    this.schedule(alarm);
  }
}

// WATCHDOG (RP2040 data sheet, 4.7): a countdown that resets the chip once, scratch registers that outlive it, and the
// tick that TIMER counts. The counter falls by two each tick (erratum RP2040-E1): 2 counts are one microsecond.

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
