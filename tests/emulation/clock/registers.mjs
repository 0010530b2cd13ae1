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
