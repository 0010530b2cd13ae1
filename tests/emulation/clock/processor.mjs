// SPDX-License-Identifier: Apache-2.0
// Interrupts as ARMv6-M takes them. rp2040js has priorities and nesting right, but: it drops a pending interrupt whose line falls,
// keeps one pended by software for ever, enters a handler out of WFI although PRIMASK is set, and takes no time for entry and return.

const FIRST_IRQ = 16;
const LOWEST = 4;
const NVIC_ICPR = 0x280;

/** Cycles of exception entry (Cortex-M0+ manual, zero wait states) and of return (estimate: eight words off the stack). */
export const ENTRY_CYCLES = 15;
export const RETURN_CYCLES = 13;

export class Nvic {
  constructor(chip, core) {
    this.chip = chip;
    this.core = core;
    this.lines = 0;
    core.setInterrupt = (irq, level) => this.setLine(irq, level);
    this.wrapEntry();
    this.wrapReturn();
  }

  /** A line of a peripheral; its rise makes the interrupt pending, its fall does not take that back. */
  setLine(irq, level) {
    const bit = 1 << irq;
    const was = (this.lines & bit) !== 0;
    if (was === level) return;
    this.lines ^= bit;
    if (level) this.pend(bit);
  }

  pend(bits) {
    this.core.pendingInterrupts |= bits;
    this.core.interruptsUpdated = true;
  }

  wrapEntry() {
    const entry = this.core.exceptionEntry.bind(this.core);
    this.core.exceptionEntry = (number) => {
      entry(number);
      if (number >= FIRST_IRQ) this.core.pendingInterrupts &= ~(1 << (number - FIRST_IRQ));
    };
  }

  wrapReturn() {
    const leave = this.core.exceptionReturn.bind(this.core);
    this.core.exceptionReturn = (value) => {
      const number = this.core.IPSR;
      leave(value);
      if (number >= FIRST_IRQ) this.pend(this.lines & (1 << (number - FIRST_IRQ)));
      this.chip.spend(RETURN_CYCLES);
    };
  }

  /** ICPR: what a line still holds up comes back at once. */
  writeRegister(offset, value) {
    if (offset !== NVIC_ICPR) return false;
    this.core.pendingInterrupts &= ~value | this.lines;
    return true;
  }

  /** True if something would end a WFI: PRIMASK does not count for that. */
  wouldWake() {
    const { core } = this;
    if (core.pendingNMI) return true;
    const now = core.exceptionPriority(core.IPSR);
    const ready = core.pendingInterrupts & core.enabledInterrupts;
    for (let priority = 0; priority < Math.min(now, LOWEST); priority++) {
      if (ready & core.interruptPriorities[priority]) return true;
      if (core.pendingSystick && core.systickPriority === priority) return true;
      if (core.pendingPendSV && core.pendSVPriority === priority) return true;
    }
    return false;
  }
}

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

// The memory protection unit (ARMv6-M, B3.5), as far as a guard needs it: regions without any access. A load or store there is a hard
// fault; in the hard fault handler itself nothing is checked (HFNMIENA 0). Other permissions are errors here.

const CTRL = 0xd94;
const NUMBER = 0xd98;
const BASE = 0xd9c;
const ATTRIBUTES = 0xda0;
const TYPE = 0xd90;
const REGIONS = 8;
const HARD_FAULT = 3;

export class Mpu {
  constructor(chip) {
    this.chip = chip;
    this.control = 0;
    this.number = 0;
    this.regions = Array.from({ length: REGIONS }, () => ({ base: 0, attributes: 0 }));
    this.guarded = []; // [begin, end) without access
    // All of them lie in this range; the processor's accesses look at it first (core/access.mjs).
    this.from = 0;
    this.to = 0;
  }

  handles(offset) {
    return offset >= TYPE && offset <= ATTRIBUTES;
  }

  read(offset) {
    const { base, attributes } = this.regions[this.number];
    return { [TYPE]: REGIONS << 8, [CTRL]: this.control, [NUMBER]: this.number, [BASE]: base | this.number, [ATTRIBUTES]: attributes }[offset];
  }

  write(offset, value) {
    if (offset === CTRL) this.control = value & 7;
    else if (offset === NUMBER) this.number = value % REGIONS;
    else if (offset === BASE) this.setBase(value);
    else if (offset === ATTRIBUTES) this.regions[this.number].attributes = value;
    this.update();
  }

  setBase(value) {
    if (value & 0x10) this.number = value & 7;
    this.regions[this.number].base = (value & ~0xff) >>> 0;
  }

  update() {
    const active = this.control & 1 ? this.regions.filter(({ attributes }) => attributes & 1) : [];
    this.guarded = active.map(({ base, attributes }) => {
      if ((attributes >>> 24) & 7) this.chip.fault('an MPU region with access is not modelled');
      return [base, base + 2 ** (((attributes >>> 1) & 31) + 1)];
    });
    if (this.guarded.length > 0 && !(this.control & 4)) this.chip.fault('an MPU without the default map is not modelled');
    this.from = Math.min(...this.guarded.map(([begin]) => begin), Infinity);
    this.to = Math.max(...this.guarded.map(([, end]) => end), 0);
  }

  /** An access between `from` and `to`: an error if a region guards the address. */
  check(address) {
    if (this.chip.core.IPSR === HARD_FAULT) return;
    for (const [begin, end] of this.guarded) if (address >= begin && address < end) this.refuse(address);
  }

  refuse(address) {
    this.chip.fault(`an access at 0x${address.toString(16)}, which the MPU guards`);
  }
}
