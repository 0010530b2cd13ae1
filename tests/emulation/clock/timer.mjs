// SPDX-License-Identifier: Apache-2.0
// TIMER: 64 bits of microseconds and four alarms, exact to the cycle (RP2040 data sheet, 4.6).
// It counts the watchdog's tick, so it stands still until that is enabled. An alarm compares 32 bits: one set in the past
// fires after 2^32 us, as on silicon.

import { CYCLES_PER_MICROSECOND } from './constants.mjs';

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
