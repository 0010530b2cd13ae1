// SPDX-License-Identifier: Apache-2.0
// Thumb branches and moves of high registers (ARMv6-M, A6.7). PC already stands behind the instruction's first half.

const conditions = [
  (c) => c.Z,
  (c) => !c.Z,
  (c) => c.C,
  (c) => !c.C,
  (c) => c.N,
  (c) => !c.N,
  (c) => c.V,
  (c) => !c.V,
  (c) => c.C && !c.Z,
  (c) => !c.C || c.Z,
  (c) => c.N === c.V,
  (c) => c.N !== c.V,
  (c) => !c.Z && c.N === c.V,
  (c) => c.Z || c.N !== c.V,
];

export function branchIf(c, op) {
  if (!conditions[(op >>> 8) & 15](c)) return 1;
  c.registers[15] += 2 + ((op << 24) >> 23);
  return 2;
}

export function branch(c, op) {
  c.registers[15] += 2 + ((op << 21) >> 20);
  return 2;
}

const high = (op) => ((op >>> 4) & 8) | (op & 7);
const valueOf = (c, index) => (index === 15 ? c.registers[15] + 2 : c.registers[index]);

/** Writes a register that may be SP (words only) or PC; its cycles. */
function writeHigh(c, index, value) {
  c.registers[index] = index === 15 ? value & ~1 : index === 13 ? value & ~3 : value;
  return index === 15 ? 2 : 1;
}

export const addHigh = (c, op) => writeHigh(c, high(op), valueOf(c, high(op)) + valueOf(c, (op >>> 3) & 15));
export const moveHigh = (c, op) => writeHigh(c, high(op), valueOf(c, (op >>> 3) & 15));

/** BX and BLX. */
export function branchExchange(c, op) {
  const target = c.registers[(op >>> 3) & 15];
  if (op & 0x80) {
    c.registers[14] = c.registers[15] | 1;
    c.registers[15] = target & ~1;
  } else {
    c.BXWritePC(target);
  }
  return 2;
}
