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
