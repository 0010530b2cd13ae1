// SPDX-License-Identifier: Apache-2.0
// One PIO block: instruction memory, four state machines, flags, pins and registers (RP2040 data sheet, 3.7).
// It stands in for rp2040js' block, which runs free of the clock, ignores dividers and resolves stalls in its own way.

import { idleClocks, passIdle } from './idle.mjs';
import { Machine } from './machine.mjs';
import { readRegister, writeRegister } from './registers.mjs';

const rotateLeft = (value, by) => ((value << by) | (by ? value >>> (32 - by) : 0)) >>> 0;

/** `value`, with the field of `count` pins from `base` on (wrapping round pin 31) replaced. */
function replaceField(value, base, count, field) {
  const mask = count >= 32 ? 0xffffffff : (1 << count) - 1;
  const place = rotateLeft(mask >>> 0, base);
  return ((value & ~place) | (rotateLeft((field & mask) >>> 0, base) & place)) >>> 0;
}

export class PioBlock {
  /** `chip` gives: settle(), disturb(), fault(text), pinsChanged(mask), setInterrupt(irq, level), dma. */
  constructor(chip, index) {
    this.chip = chip;
    this.index = index;
    this.memory = new Uint16Array(32);
    this.machines = [];
    this.machines = [0, 1, 2, 3].map((i) => new Machine(this, i));
    this.reset();
  }

  reset() {
    this.memory.fill(0);
    this.values = 0;
    this.directions = 0;
    this.irq = 0;
    this.debug = 0;
    this.inputs = 0;
    this.bypass = 0;
    this.enables = [0, 0];
    this.forces = [0, 0];
    this.setFlags = 0;
    this.clearFlags = 0;
    this.linesStale = true;
    for (const machine of this.machines) {
      machine.tx.clear();
      machine.rx.clear();
      machine.reset();
    }
    this.updateLines();
    for (const machine of this.machines) this.fifosChanged(machine);
  }

  unsupported(what) {
    this.chip.fault(`PIO${this.index}: ${what} is not modelled`);
    return 0;
  }

  /** One system cycle of all four; effects on flags become visible together at its end. */
  cycle() {
    for (const machine of this.machines) machine.cycle();
    this.finish();
  }

  finish() {
    if (this.setFlags | this.clearFlags) {
      this.irq = ((this.irq & ~this.clearFlags) | this.setFlags) & 0xff;
      this.setFlags = 0;
      this.clearFlags = 0;
      this.linesStale = true;
    }
    if (this.linesStale) this.updateLines();
  }

  setIrq(number) {
    this.setFlags |= 1 << number;
  }

  clearIrq(number) {
    this.clearFlags |= 1 << number;
  }

  txStall(machine) {
    this.debug |= 1 << (24 + machine.index);
    return false;
  }

  rxStall(machine) {
    this.debug |= 1 << machine.index;
    return false;
  }

  writePins(base, count, field) {
    this.values = replaceField(this.values, base, count, field);
  }

  writeDirections(base, count, field) {
    this.directions = replaceField(this.directions, base, count, field);
  }

  /** Raw interrupts: RX not empty, TX not full, flags 0 to 3. */
  get rawInterrupts() {
    let raw = (this.irq & 15) << 8;
    for (const machine of this.machines) {
      if (!machine.rx.empty) raw |= 1 << machine.index;
      if (!machine.tx.full) raw |= 16 << machine.index;
    }
    return raw;
  }

  lineStatus(line) {
    if ((this.enables[line] | this.forces[line]) === 0) return 0;
    return (this.rawInterrupts & this.enables[line]) | this.forces[line];
  }

  updateLines() {
    this.linesStale = false;
    for (let line = 0; line < 2; line++) this.chip.setInterrupt(7 + 2 * this.index + line, this.lineStatus(line) !== 0);
  }

  /** Tells the DMA which of a machine's FIFOs want service. */
  fifosChanged(machine) {
    this.linesStale = true;
    this.chip.setDreq(8 * this.index + machine.index, !machine.tx.full);
    this.chip.setDreq(8 * this.index + 4 + machine.index, !machine.rx.empty);
  }

  /** System cycles for which all four are idle. */
  idleCycles() {
    let cycles = Infinity;
    for (const machine of this.machines) {
      if (!machine.enabled && !machine.forced) continue;
      if (machine.forced && machine.enabled) return 0;
      const clocks = idleClocks(machine);
      if (clocks === 0) return 0;
      const limit = Math.ceil((machine.divider * (clocks + 1) - machine.phase) / 256) - 1;
      cycles = Math.min(cycles, machine.forced ? clocks : limit);
    }
    return cycles;
  }

  passIdle(cycles) {
    for (const machine of this.machines) {
      if (machine.forced) machine.retryForced();
      if (!machine.enabled || machine.forced) continue;
      const phase = machine.phase + 256 * cycles;
      const clocks = Math.floor(phase / machine.divider);
      machine.phase = phase - clocks * machine.divider;
      passIdle(machine, clocks);
    }
  }

  // What rp2040js asks of a block.
  get pinValues() {
    return this.values;
  }

  get pinDirections() {
    return this.directions;
  }

  readUint32(offset) {
    this.chip.settle();
    return readRegister(this, offset) >>> 0;
  }

  /** A write through one of the atomic aliases (xor, set, clear) acts on what a read gives. */
  writeUint32Atomic(offset, value, alias) {
    this.chip.disturb();
    const before = alias ? readRegister(this, offset, true) : 0;
    const after = [value, before ^ value, before | value, before & ~value][alias];
    writeRegister(this, offset, after >>> 0, value >>> 0);
    this.finish();
    this.chip.pinsChanged();
  }

  writeUint32(offset, value) {
    this.writeUint32Atomic(offset, value, 0);
  }
}
