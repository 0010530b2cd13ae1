// SPDX-License-Identifier: Apache-2.0
// One clock for processor, PIO, DMA, timers and the world outside.
//
// The processor executes an instruction at a cycle, then the other blocks run for as many cycles as it took. The PIO is stepped in
// each cycle, except where `quietUntil` says that it only counts or stalls: then it lags behind and is brought up to date ("settled") when
// something touches it. Alarms (DMA, timers, USB, stimuli) are always met at their cycle.

const SHORT_QUIET = 4; // a quiet stretch this short is not worth looking for again at once
const BACK_OFF = 8;

export class Scheduler {
  constructor(chip, fastForward) {
    this.chip = chip;
    this.fastForward = fastForward;
    this.cycle = 0;
    this.debt = 0;
    this.stepped = 0; // PIO cycles taken one by one
    this.instructions = 0;
    this.restart();
  }

  /** After a reset of the chip. */
  restart() {
    this.pioAt = this.cycle;
    this.quietUntil = this.cycle;
    this.backOff = 0;
    this.debt = 0;
  }

  run(cycles, until) {
    const end = this.cycle + cycles;
    while (this.cycle < end) {
      if (this.chip.resetRequest) this.chip.performReset();
      this.processorStep(end);
      if (until?.()) return true;
    }
    return false;
  }

  /** One instruction, one exception entry, or one stretch of sleep. */
  processorStep(end) {
    const { core } = this.chip;
    if (this.chip.halted || this.chip.lockedUp) return this.chunk(end);
    if (core.waiting) {
      if (!this.chip.nvic.wouldWake()) return this.chunk(end);
      core.waiting = false;
    }
    let spent = 0;
    if (!core.interruptsUpdated || !this.chip.takeException()) {
      spent = this.instruction(core);
      this.instructions++;
    }
    spent += this.debt;
    this.debt = 0;
    return this.advance(this.cycle + spent);
  }

  instruction(core) {
    const pc = core.registers[15];
    try {
      return core.executeInstruction();
    } catch (error) {
      return this.chip.hardFault(error, pc);
    }
  }

  advance(target) {
    const { clock } = this.chip;
    while (this.cycle < target) {
      const then = target * NANOSECONDS_PER_CYCLE;
      const nothingDue = target <= this.quietUntil && (clock.nextAlarm === null || clock.nextAlarm.nanos > then);
      if (!nothingDue) {
        this.chunk(target);
        continue;
      }
      clock.nanosCounter = then; // what tick() does when no alarm is due
      this.cycle = target;
    }
  }

  /** Passes time up to `target` at most, and at least one cycle. */
  chunk(target) {
    if (this.quietUntil <= this.cycle) this.lookAhead();
    let to = Math.min(target, this.quietUntil);
    if (to <= this.cycle) return this.pioCycle();
    const alarm = this.chip.clock.nextAlarm;
    if (alarm) to = Math.min(to, Math.max(this.cycle + 1, Math.ceil(alarm.nanos / NANOSECONDS_PER_CYCLE)));
    const cycles = to - this.cycle;
    this.cycle = to;
    return this.chip.clock.tick(cycles * NANOSECONDS_PER_CYCLE);
  }

  /** All PIO state machines for one cycle, then the alarms of its end. */
  pioCycle() {
    this.settle();
    this.refreshInputs();
    for (const block of this.chip.pio) block.cycle();
    this.cycle++;
    this.stepped++;
    this.pioAt = this.cycle;
    this.chip.pinsChanged();
    this.chip.clock.tick(NANOSECONDS_PER_CYCLE);
  }

  refreshInputs() {
    for (const block of this.chip.pio) block.inputs = this.chip.pads.synchronised(this.cycle, block.bypass);
  }

  /** Finds how long the PIO will be quiet from now on. */
  lookAhead() {
    this.quietUntil = this.cycle;
    if (!this.fastForward) return;
    if (this.backOff > 0) {
      this.backOff--;
      return;
    }
    this.settle();
    this.refreshInputs();
    const idle = Math.min(this.chip.pio[0].idleCycles(), this.chip.pio[1].idleCycles());
    this.quietUntil = Math.min(this.cycle + idle, this.chip.pads.nextChange);
    if (idle < SHORT_QUIET) this.backOff = BACK_OFF;
  }

  /** Brings the PIO up to now. */
  settle() {
    if (this.pioAt === this.cycle || !this.chip.pio) return;
    for (const block of this.chip.pio) block.passIdle(this.cycle - this.pioAt);
    this.pioAt = this.cycle;
  }

  /** Someone is about to change the PIO: nothing is known about its future any more. */
  disturb() {
    if (!this.chip.pio) return; // while the chip is being built
    this.settle();
    this.refreshInputs();
    this.quietUntil = this.cycle;
    this.backOff = 0;
  }

  /** An input changed: the PIO sees it once it is through the synchroniser, or at once where that is bypassed. */
  inputsChanged() {
    const { pio, pads } = this.chip;
    if (!pio) return;
    if (pio[0].bypass | pio[1].bypass) this.disturb();
    else this.quietUntil = Math.min(this.quietUntil, pads.nextChange);
  }
}

// One cycle is 8 ns: clk_sys is 125 MHz. All times of the emulation are whole cycles since power-up.

export const NANOSECONDS_PER_CYCLE = 8;
export const CYCLES_PER_MICROSECOND = 125;
export const CYCLES_PER_MILLISECOND = 125_000;
export const CLOCK_HZ = 125_000_000;

// Events at whole cycles, on rp2040js' clock. Those that belong to the chip die with it at a reset; those of the world outside
// (stimuli, the USB bus) go on.

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
