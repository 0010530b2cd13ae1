// SPDX-License-Identifier: Apache-2.0
// Thumb instructions that compute (ARMv6-M, A6.7). `c` is rp2040js' core; each returns its cycles.

const sign = (value) => value < 0;

function setNz(c, result) {
  c.N = sign(result | 0);
  c.Z = (result | 0) === 0;
}

/** a + b + carry with all flags. */
function add(c, a, b, carry) {
  const sum = a + b + carry;
  const result = sum | 0;
  c.C = sum > 0xffffffff;
  c.V = ((a ^ result) & (b ^ result)) < 0;
  setNz(c, result);
  return result;
}

/** a - b - 1 + carry: an addition of the complement. */
const subtract = (c, a, b, carry = 1) => add(c, a, ~b >>> 0, carry);

// ---- shifts by a constant: a count of 0 means 32 to the right, and a plain move to the left

export function lslImmediate(c, op) {
  const r = c.registers;
  const count = (op >>> 6) & 31;
  const input = r[(op >>> 3) & 7];
  if (count) c.C = ((input >>> (32 - count)) & 1) === 1;
  setNz(c, (r[op & 7] = input << count));
  return 1;
}

export function lsrImmediate(c, op) {
  const r = c.registers;
  const count = (op >>> 6) & 31 || 32;
  const input = r[(op >>> 3) & 7];
  c.C = ((input >>> (count - 1)) & 1) === 1;
  setNz(c, (r[op & 7] = count === 32 ? 0 : input >>> count));
  return 1;
}

export function asrImmediate(c, op) {
  const r = c.registers;
  const count = (op >>> 6) & 31 || 32;
  const input = r[(op >>> 3) & 7];
  c.C = ((input >> (count - 1)) & 1) === 1;
  setNz(c, (r[op & 7] = input >> Math.min(31, count)));
  return 1;
}

// ---- additions and subtractions

export function addSubtract(c, op) {
  const r = c.registers;
  const field = (op >>> 6) & 7;
  const operand = op & 0x400 ? field : r[field];
  const first = r[(op >>> 3) & 7];
  r[op & 7] = op & 0x200 ? subtract(c, first, operand) : add(c, first, operand, 0);
  return 1;
}

export function moveImmediate(c, op) {
  setNz(c, (c.registers[(op >>> 8) & 7] = op & 255));
  return 1;
}

export function compareImmediate(c, op) {
  subtract(c, c.registers[(op >>> 8) & 7], op & 255);
  return 1;
}

export function addImmediate(c, op) {
  const register = (op >>> 8) & 7;
  c.registers[register] = add(c, c.registers[register], op & 255, 0);
  return 1;
}

export function subtractImmediate(c, op) {
  const register = (op >>> 8) & 7;
  c.registers[register] = subtract(c, c.registers[register], op & 255);
  return 1;
}

// ---- shifts by a register: a count of 0 leaves the carry alone, more than 32 clears it (or fills with the sign)

const shifts = {
  left(c, value, count) {
    if (count > 0) c.C = count <= 32 && ((value >>> (32 - count)) & 1) === 1;
    return count < 32 ? value << count : 0;
  },
  right(c, value, count) {
    if (count > 0) c.C = count <= 32 && ((value >>> (count - 1)) & 1) === 1;
    return count < 32 ? value >>> count : 0;
  },
  arithmetic(c, value, count) {
    if (count > 0) c.C = ((value >> Math.min(31, count - 1)) & 1) === 1;
    return value >> Math.min(31, count);
  },
  rotate(c, value, count) {
    const by = count & 31;
    const result = by ? (value >>> by) | (value << (32 - by)) : value | 0;
    if (count > 0) c.C = result < 0;
    return result;
  },
};

const shiftBy = (shift) => (c, op) => {
  const r = c.registers;
  setNz(c, (r[op & 7] = shift(c, r[op & 7], r[(op >>> 3) & 7] & 255)));
  return 1;
};

// ---- two registers, by bits 6 to 9

const logic = (compute) => (c, op) => {
  const r = c.registers;
  setNz(c, (r[op & 7] = compute(r[op & 7], r[(op >>> 3) & 7])));
  return 1;
};

const arithmetic = (compute) => (c, op) => {
  const r = c.registers;
  r[op & 7] = compute(c, r[op & 7], r[(op >>> 3) & 7]);
  return 1;
};

const compare = (compute) => (c, op) => {
  compute(c, c.registers[op & 7], c.registers[(op >>> 3) & 7]);
  return 1;
};

export const twoRegisters = [
  logic((a, b) => a & b),
  logic((a, b) => a ^ b),
  shiftBy(shifts.left),
  shiftBy(shifts.right),
  shiftBy(shifts.arithmetic),
  arithmetic((c, a, b) => add(c, a, b, +c.C)),
  arithmetic((c, a, b) => subtract(c, a, b, +c.C)),
  shiftBy(shifts.rotate),
  compare((c, a, b) => setNz(c, a & b)),
  arithmetic((c, a, b) => subtract(c, 0, b)),
  compare((c, a, b) => subtract(c, a, b)),
  compare((c, a, b) => add(c, a, b, 0)),
  logic((a, b) => a | b),
  logic((a, b) => Math.imul(a, b)),
  logic((a, b) => a & ~b),
  logic((a, b) => ~b),
];

// ---- the rest

export function compareHigh(c, op) {
  const r = c.registers;
  const value = (index) => (index === 15 ? r[15] + 2 : r[index]);
  subtract(c, value(((op >>> 4) & 8) | (op & 7)), value((op >>> 3) & 15));
  return 1;
}

export function addressOfSp(c, op) {
  c.registers[(op >>> 8) & 7] = c.registers[13] + ((op & 255) << 2);
  return 1;
}

export function addressOfPc(c, op) {
  c.registers[(op >>> 8) & 7] = ((c.registers[15] + 2) & ~3) + ((op & 255) << 2);
  return 1;
}

export function moveStack(c, op) {
  const bytes = (op & 127) << 2;
  c.registers[13] += op & 0x80 ? -bytes : bytes;
  return 1;
}

const extend = [(v) => (v << 16) >> 16, (v) => (v << 24) >> 24, (v) => v & 0xffff, (v) => v & 0xff];

export function extendRegister(c, op) {
  c.registers[op & 7] = extend[(op >>> 6) & 3](c.registers[(op >>> 3) & 7]);
  return 1;
}
