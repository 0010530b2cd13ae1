// SPDX-License-Identifier: Apache-2.0
// How long a state machine will do nothing that anyone could see: it is stalled, or it goes round a loop of jumps that only counts
// X or Y down. Such stretches are passed over in one stride; every result is the same as cycle by cycle (the tests compare).

import { irqNumber, waitedFor } from './instructions.mjs';
import { NONE } from './machine.mjs';

const LONGEST_PATH = 16;
const NOP = 0xa042; // mov y, y

/** A copy of what jumps look at, tried on ahead of the machine itself. One is enough: it lives for one call. */
const trial = { pc: 0, x: 0, y: 0, compares: false };

/** True if this instruction, already stalled, stays so while nothing around it changes. */
function staysStalled(m, opcode) {
  const block = m.block;
  switch (opcode >>> 13) {
    case 1:
      return waitedFor(m, opcode) !== ((opcode >>> 7) & 1);
    case 2:
      return m.rx.full;
    case 3:
      return m.tx.empty && m.osrCount >= m.shift.pullThreshold;
    case 4:
      return opcode & 0x80 ? m.tx.empty : m.rx.full;
    case 6:
      return m.irqWaiting && ((block.irq >>> irqNumber(m, opcode & 31)) & 1) === 1;
    default:
      return false;
  }
}

/** True if the side-set of this instruction leaves every pin as it is. */
function sideSetIsQuiet(m, opcode) {
  const value = m.sideValue(opcode);
  if (value === NONE) return true;
  const count = m.pins.sideCount - (m.exec.sideOptional ? 1 : 0);
  const now = m.exec.sideDirections ? m.block.directions : m.block.values;
  for (let bit = 0; bit < count; bit++) {
    if (((now >>> ((m.pins.sideBase + bit) & 31)) & 1) !== ((value >>> bit) & 1)) return false;
  }
  return true;
}

/** Whether a jump is taken by the trial copy, which counts down if it has to. */
function jumps(m, opcode) {
  switch ((opcode >>> 5) & 7) {
    case 0:
      return true;
    case 1:
      return trial.x === 0;
    case 2:
      trial.x--;
      return true;
    case 3:
      return trial.y === 0;
    case 4:
      trial.y--;
      return true;
    case 5:
      trial.compares = true;
      return trial.x !== trial.y;
    case 6:
      return ((m.block.inputs >>> m.exec.jumpPin) & 1) === 1;
    default:
      return m.osrCount < m.shift.pullThreshold;
  }
}

const nextPlace = (m, pc) => (pc === m.exec.wrapTop ? m.exec.wrapBottom : (pc + 1) & 31);

/** Rounds of a loop that stay clear of zero by one round. */
const safeRounds = (start, perRound) => (perRound === 0 ? Infinity : Math.floor((start - 1) / perRound) - 1);

/** Clocks until a loop that has come back to its begin might change its way. */
function loopClocks(m, period) {
  const dx = m.x - trial.x;
  const dy = m.y - trial.y;
  if (trial.compares && dx + dy > 0) return 0;
  const rounds = Math.min(safeRounds(m.x, dx), safeRounds(m.y, dy));
  if (rounds < 1) return 0;
  m.loop = Object.assign(m.loopMemory, { pc: m.pc, period, dx, dy });
  return rounds * period;
}

/** Clocks of the state machine for which it only counts or stalls; 0 if it acts now. */
export function idleClocks(m) {
  m.loop = null;
  const refills = m.shift.autopull && m.osrCount >= m.shift.pullThreshold && !m.tx.empty;
  if (refills) return 0;
  if (m.stalled) return staysStalled(m, m.latch !== NONE ? m.latch : m.block.memory[m.pc]) ? Infinity : 0;
  if (m.latch !== NONE) return 0;
  trial.pc = m.pc;
  trial.x = m.x;
  trial.y = m.y;
  trial.compares = false;
  let clocks = m.delay;
  for (let i = 0; i < LONGEST_PATH; i++) {
    const opcode = m.block.memory[trial.pc];
    if (opcode >>> 13 !== 0 && (opcode & 0xe0ff) !== NOP) return clocks;
    if (!sideSetIsQuiet(m, opcode)) return clocks;
    if (opcode >>> 13 !== 0 || !jumps(m, opcode)) trial.pc = nextPlace(m, trial.pc);
    else trial.pc = opcode & 31;
    if (trial.x < 0 || trial.y < 0) return clocks; // a counter passes zero here
    clocks += 1 + m.delayOf(opcode);
    if (trial.pc === m.pc) return Math.max(clocks, m.delay + loopClocks(m, clocks - m.delay));
  }
  return clocks;
}

/** Passes `clocks` idle clocks, whole rounds of the loop at once. */
export function passIdle(m, clocks) {
  if (m.stalled) {
    if (clocks > 0) m.step(); // sets its stall flag again, should that have been cleared meanwhile
    return;
  }
  while (clocks > 0) {
    const { loop } = m;
    if (loop && m.delay === 0 && m.pc === loop.pc && clocks >= loop.period) {
      const rounds = Math.floor(clocks / loop.period);
      m.x -= rounds * loop.dx;
      m.y -= rounds * loop.dy;
      clocks -= rounds * loop.period;
    } else {
      m.step();
      clocks--;
    }
  }
}
