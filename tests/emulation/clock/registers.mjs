// SPDX-License-Identifier: Apache-2.0
// Blocks that only keep what is written: ROSC, voltage regulator and IO_QSPI, which rp2040js leaves out.

export class RegisterFile {
  /** `fixed`: reads that do not depend on writes, offset -> function. */
  constructor(initial = {}, fixed = {}) {
    this.words = new Map(Object.entries(initial).map(([offset, value]) => [Number(offset), value]));
    this.fixed = fixed;
  }

  readUint32(offset) {
    return this.fixed[offset]?.() ?? this.words.get(offset) ?? 0;
  }

  writeUint32Atomic(offset, value, alias) {
    const before = alias ? this.readUint32(offset) : 0;
    this.words.set(offset, [value, before ^ value, before | value, before & ~value][alias] >>> 0);
  }
}

/** ROSC: enabled and stable; the random bit is a fixed pseudo-random sequence, so that runs repeat. */
export function ringOscillator() {
  let state = 0xace1;
  const randomBit = () => {
    state = (state >>> 1) ^ (state & 1 ? 0xb400 : 0);
    return state & 1;
  };
  return new RegisterFile({}, { 0x18: () => 0x80001000, 0x1c: randomBit });
}

/** PADS_QSPI, as after a reset (data sheet, 2.19.6.4): voltage, clock, four data pins, select. */
export const qspiPads = () => new RegisterFile({ 0x00: 0, 0x04: 0x56, 0x08: 0x52, 0x0c: 0x52, 0x10: 0x52, 0x14: 0x52, 0x18: 0x5a });

/** VREG_AND_CHIP_RESET: in regulation, at 1.1 V; the last chip reset was power-up. */
export const voltageRegulator = () => new RegisterFile({ 0: 0xb1, 4: 0x91, 8: 1 << 8 }, { 0: () => 0x10b1 });

// RESETS (RP2040 data sheet, 2.14): after power-up nearly every block is held in reset. Touching such a block is a bus fault on
// silicon and an error here; putting one into reset sets its registers back.

/** Bit of each block that is modelled, by the base address as rp2040js keys its peripherals. */
export const RESET_BITS = {
  0x4004c: 0, 0x50000: 2, 0x40044: 3, 0x40048: 4, 0x40014: 5, 0x40018: 6, 0x4001c: 8, 0x40020: 9, 0x50200: 10, 0x50300: 11,
  0x40028: 12, 0x4002c: 13, 0x40050: 14, 0x4005c: 15, 0x4003c: 16, 0x40040: 17, 0x40054: 21, 0x40034: 22, 0x40038: 23, 0x50110: 24,
};
const ALL = 0x1ffffff;
const RELEASED_BY_ROM = (1 << 6) | (1 << 9); // IO_QSPI, PADS_QSPI: the flash

export class Resets {
  /** `onReset(bit)`: a block goes into reset. */
  constructor(onReset) {
    this.held = ALL & ~RELEASED_BY_ROM;
    this.select = 0;
    this.onReset = onReset;
  }

  readUint32(offset) {
    if (offset === 0) return this.held;
    if (offset === 4) return this.select;
    return ALL & ~this.held;
  }

  writeUint32Atomic(offset, value, alias) {
    const before = alias ? this.readUint32(offset) : 0;
    const after = [value, before ^ value, before | value, before & ~value][alias] & ALL;
    if (offset === 4) this.select = after;
    if (offset !== 0) return;
    const fresh = after & ~this.held;
    this.held = after;
    for (let bit = 0; bit < 25; bit++) if ((fresh >>> bit) & 1) this.onReset(bit);
  }
}

// What the emulated chip cannot go on from: silicon would hang, fault or do something that is not modelled.

export class EmulationFault extends Error {
  constructor(what, { cycle, pc }) {
    super(`${what} (cycle ${cycle}, pc 0x${pc.toString(16)})`);
    this.name = 'EmulationFault';
    this.cycle = cycle;
    this.pc = pc;
  }
}
