// SPDX-License-Identifier: Apache-2.0
// One PIO state machine: what it keeps, and what happens in one clock of it (RP2040 data sheet, 3.2 to 3.5).

import { execute } from './instructions.mjs';

export const NONE = -1;

/** The OUT class: the only one in whose cycles the background refill of autopull takes another way. */
const isOut = (opcode) => opcode >>> 13 === 0b011;

export class Machine {
  constructor(block, index) {
    this.block = block;
    this.index = index;
    this.tx = new Fifo(4);
    this.rx = new Fifo(4);
    this.loopMemory = { pc: 0, period: 0, dx: 0, dy: 0 };
    this.loop = null; // of what idle.mjs found
    this.reset();
  }

  /** Power-up: registers as the data sheet gives them. */
  reset() {
    this.enabled = false;
    Object.assign(this, { pc: 0, x: 0, y: 0, osr: 0, latch: NONE, nextLatch: NONE, phase: 0 });
    this.setExecControl(0x1f << 12);
    this.setPinControl(0x14000000);
    this.divider = 256;
    this.dividerRegister = 0x10000;
    this.setShiftControl(0x000c0000);
    this.restart();
  }

  setExecControl(value) {
    this.execRegister = (value & 0x7fffffff) >>> 0;
    this.exec = execControl(value);
    if (this.exec.outSticky || this.exec.inlineOutEnable) this.block.unsupported('OUT_STICKY and INLINE_OUT_EN');
  }

  setPinControl(value) {
    this.pinRegister = value >>> 0;
    this.pins = pinControl(value);
  }

  setDivider(value) {
    this.dividerRegister = value >>> 0;
    this.divider = clockDivider(value);
  }

  /** SHIFTCTRL: changing a join empties both FIFOs. */
  setShiftControl(value) {
    this.shiftRegister = value >>> 0;
    this.shift = shiftControl(value);
    const [tx, rx] = fifoDepths(this.shift);
    if (tx !== this.tx.depth || rx !== this.rx.depth) {
      this.tx.clear(tx);
      this.rx.clear(rx);
    }
    this.block.fifosChanged(this);
  }

  /** SM_RESTART: shift counters, ISR, delay, latched instruction and waits; not PC, X, Y, OSR. */
  restart() {
    this.isr = 0;
    this.isrCount = 0;
    this.osrCount = 32;
    this.delay = 0;
    this.latch = NONE;
    this.forced = false;
    this.irqWaiting = false;
    this.stalled = false;
  }

  /** One system cycle. A latched forced instruction minds neither the divider nor the enable bit. */
  cycle() {
    if (this.forced) return this.retryForced();
    if (!this.enabled) return;
    this.phase += 256;
    if (this.phase < this.divider) return;
    this.phase -= this.divider;
    this.step();
  }

  /** One clock of the state machine. */
  step() {
    if (this.delay > 0) {
      this.delay--;
      this.refill();
      return;
    }
    const latched = this.latch !== NONE;
    const opcode = latched ? this.latch : this.block.memory[this.pc];
    if (!this.attempt(opcode)) return;
    this.latch = this.nextLatch;
    if (!this.jumped && !latched) this.pc = this.pc === this.exec.wrapTop ? this.exec.wrapBottom : (this.pc + 1) & 31;
    // The delay of an OUT EXEC or MOV EXEC itself is ignored; that of the executed instruction counts.
    this.delay = this.latch === NONE ? this.delayOf(opcode) : 0;
  }

  /** Executes, side-sets and refills; false if it stalls. Side-set takes place in the first cycle even so. */
  attempt(opcode) {
    this.jumped = false;
    this.nextLatch = NONE;
    const done = execute(this, opcode);
    this.sideSet(opcode);
    if (!isOut(opcode)) this.refill();
    this.stalled = !done;
    return done;
  }

  /** SMx_INSTR: at once, without delay, PC kept; if it stalls it is latched and tried every cycle. */
  force(opcode) {
    const waiting = this.irqWaiting;
    this.irqWaiting = false;
    this.forced = !this.attempt(opcode);
    this.latch = this.forced ? opcode : this.nextLatch !== NONE ? this.nextLatch : this.latch;
    if (this.forced) return;
    this.irqWaiting = waiting && !this.jumped;
    if (this.jumped) this.delay = 0;
  }

  retryForced() {
    if (!this.attempt(this.latch)) return;
    this.forced = false;
    this.latch = this.nextLatch;
  }

  /** Autopull between two OUTs: whenever the OSR is used up and a word is there. */
  refill() {
    if (!this.shift.autopull || this.osrCount < this.shift.pullThreshold || this.tx.empty) return;
    this.pullWord();
  }

  pullWord() {
    this.osr = this.tx.pull();
    this.osrCount = 0;
    this.block.fifosChanged(this);
  }

  delayOf(opcode) {
    return (opcode >>> 8) & ((1 << (5 - this.pins.sideCount)) - 1);
  }

  /** The side-set value of an instruction, or NONE. */
  sideValue(opcode) {
    const { sideCount } = this.pins;
    if (sideCount === 0) return NONE;
    const field = ((opcode >>> 8) & 31) >>> (5 - sideCount);
    if (!this.exec.sideOptional) return field;
    const enable = 1 << (sideCount - 1);
    return field & enable ? field & (enable - 1) : NONE;
  }

  sideSet(opcode) {
    const value = this.sideValue(opcode);
    if (value === NONE) return;
    const count = this.pins.sideCount - (this.exec.sideOptional ? 1 : 0);
    if (this.exec.sideDirections) this.block.writeDirections(this.pins.sideBase, count, value);
    else this.block.writePins(this.pins.sideBase, count, value);
  }

  /** MOV STATUS: all ones while the chosen FIFO holds fewer words than the level. */
  get status() {
    const fifo = this.exec.statusOfRx ? this.rx : this.tx;
    return fifo.level < this.exec.statusLevel ? 0xffffffff : 0;
  }
}

// A PIO FIFO: 4 words, or 8 or 0 when the two of a state machine are joined.

export class Fifo {
  constructor(depth) {
    this.depth = depth;
    this.words = [];
  }

  get empty() {
    return this.words.length === 0;
  }

  get full() {
    return this.words.length >= this.depth;
  }

  get level() {
    return this.words.length;
  }

  push(word) {
    this.words.push(word >>> 0);
  }

  pull() {
    return this.words.shift();
  }

  /** Empties it; a change of FJOIN does so too. */
  clear(depth = this.depth) {
    this.depth = depth;
    this.words.length = 0;
  }
}

// The four configuration registers of a state machine, decoded once per write (RP2040 data sheet, 3.7).

const bits = (value, low, count) => (value >>> low) & ((1 << count) - 1);
const flag = (value, bit) => ((value >>> bit) & 1) === 1;

/** CLKDIV: the period in 1/256 of a system cycle; an integer part of 0 means 65536. */
export function clockDivider(value) {
  return ((value >>> 16 || 65536) << 8 >>> 0) + bits(value, 8, 8);
}

export function execControl(value) {
  return {
    statusLevel: bits(value, 0, 4),
    statusOfRx: flag(value, 4),
    wrapBottom: bits(value, 7, 5),
    wrapTop: bits(value, 12, 5),
    outSticky: flag(value, 17),
    inlineOutEnable: flag(value, 18),
    jumpPin: bits(value, 24, 5),
    sideDirections: flag(value, 29),
    sideOptional: flag(value, 30),
  };
}

export function shiftControl(value) {
  return {
    autopush: flag(value, 16),
    autopull: flag(value, 17),
    inRight: flag(value, 18),
    outRight: flag(value, 19),
    pushThreshold: bits(value, 20, 5) || 32,
    pullThreshold: bits(value, 25, 5) || 32,
    joinTx: flag(value, 30),
    joinRx: flag(value, 31),
  };
}

export function pinControl(value) {
  return {
    outBase: bits(value, 0, 5),
    setBase: bits(value, 5, 5),
    sideBase: bits(value, 10, 5),
    inBase: bits(value, 15, 5),
    outCount: bits(value, 20, 6),
    setCount: bits(value, 26, 3),
    sideCount: bits(value, 29, 3),
  };
}

/** FJOIN: [depth of TX, depth of RX]. */
export function fifoDepths({ joinTx, joinRx }) {
  if (joinTx && joinRx) return [0, 0];
  return [joinTx ? 8 : joinRx ? 0 : 4, joinRx ? 8 : joinTx ? 0 : 4];
}
