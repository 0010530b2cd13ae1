// SPDX-License-Identifier: Apache-2.0
// The ROM's small functions that a firmware may call; flash is in flash.mjs. Floating point is not provided (look-ups give 0).

import { reverseBits } from '../clock/pio/instructions.mjs';

function copy(chip, to, from, count) {
  for (let i = 0; i < count; i++) chip.rp2040.writeUint8(to + i, chip.rp2040.readUint8(from + i));
  return to;
}

function fill(chip, to, value, count) {
  for (let i = 0; i < count; i++) chip.rp2040.writeUint8(to + i, value & 255);
  return to;
}

function ones(value) {
  let count = 0;
  for (let rest = value >>> 0; rest; rest = (rest & (rest - 1)) >>> 0) count++;
  return count;
}

export function smallFunctions(chip) {
  return {
    P3: ([value]) => ones(value),
    R3: ([value]) => reverseBits(value),
    L3: ([value]) => Math.clz32(value),
    T3: ([value]) => (value === 0 ? 32 : 31 - Math.clz32(value & -value)),
    MS: ([to, value, count]) => fill(chip, to, value, count),
    S4: ([to, value, count]) => fill(chip, to, value, count),
    MC: ([to, from, count]) => copy(chip, to, from, count),
    C4: ([to, from, count]) => copy(chip, to, from, count),
  };
}
