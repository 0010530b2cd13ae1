// SPDX-License-Identifier: Apache-2.0
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
