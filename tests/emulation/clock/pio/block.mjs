// SPDX-License-Identifier: Apache-2.0
// One PIO block: instruction memory, four state machines, flags, pins and registers (RP2040 data sheet, 3.7).
// It stands in for rp2040js' block, which runs free of the clock, ignores dividers and resolves stalls in its own way.

import { idleClocks, passIdle } from './idle.mjs';
import { Machine } from './machine.mjs';

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

// Reads and writes of a PIO block's registers (RP2040 data sheet, 3.7, table of registers).

const CTRL = 0x000;
const FSTAT = 0x004;
const FDEBUG = 0x008;
const FLEVEL = 0x00c;
const TXF = 0x010;
const RXF = 0x020;
const IRQ = 0x030;
const IRQ_FORCE = 0x034;
const INPUT_SYNC_BYPASS = 0x038;
const DBG_PADOUT = 0x03c;
const DBG_PADOE = 0x040;
const DBG_CFGINFO = 0x044;
const INSTR_MEM = 0x048;
const MACHINES = 0x0c8;
const INTR = 0x128;
const INTERRUPTS = 0x12c; // INTE, INTF, INTS of line 0, then of line 1

const MACHINE_STRIDE = 0x18;
const EXEC_STALLED = 0x80000000;

const inRange = (offset, first, last) => offset >= first && offset <= last;

const enabledMask = (block) => block.machines.reduce((mask, m, i) => mask | (m.enabled ? 1 << i : 0), 0);

function fifoStatus(block) {
  return block.machines.reduce(
    (word, { tx, rx }, i) => word | ((tx.empty << 24) | (tx.full << 16) | (rx.empty << 8) | +rx.full) << i,
    0,
  );
}

const fifoLevels = (block) =>
  block.machines.reduce((word, { tx, rx }, i) => word | ((tx.level | (rx.level << 4)) << (8 * i)), 0);

function readRx(block, machine) {
  if (machine.rx.empty) {
    block.debug |= 1 << (8 + machine.index); // RXUNDER
    return 0;
  }
  const word = machine.rx.pull();
  block.fifosChanged(machine);
  block.updateLines();
  block.chip.disturb();
  return word;
}

function readMachine(block, machine, register) {
  switch (register) {
    case 0x00:
      return machine.dividerRegister;
    case 0x04:
      return machine.execRegister | (machine.forced ? EXEC_STALLED : 0);
    case 0x08:
      return machine.shiftRegister;
    case 0x0c:
      return machine.pc;
    case 0x10:
      return block.memory[machine.pc];
    default:
      return machine.pinRegister;
  }
}

function readInterrupt(block, offset) {
  const line = offset >= INTERRUPTS + 12 ? 1 : 0;
  const kind = ((offset - INTERRUPTS) % 12) >>> 2;
  return [block.enables[line], block.forces[line], block.lineStatus(line)][kind];
}

const plainReads = {
  [CTRL]: enabledMask,
  [FSTAT]: fifoStatus,
  [FDEBUG]: (block) => block.debug,
  [FLEVEL]: fifoLevels,
  [IRQ]: (block) => block.irq,
  [IRQ_FORCE]: () => 0,
  [INPUT_SYNC_BYPASS]: (block) => block.bypass,
  [DBG_PADOUT]: (block) => block.values,
  [DBG_PADOE]: (block) => block.directions,
  [DBG_CFGINFO]: () => 0x00200404,
  [INTR]: (block) => block.rawInterrupts,
};

/** `peek`: the read half of an atomic write, which takes nothing out of a FIFO. */
export function readRegister(block, offset, peek = false) {
  const plain = plainReads[offset];
  if (plain) return plain(block);
  if (inRange(offset, RXF, RXF + 12)) return peek ? 0 : readRx(block, block.machines[(offset - RXF) >>> 2]);
  if (inRange(offset, TXF, TXF + 12) || inRange(offset, INSTR_MEM, INSTR_MEM + 124)) return 0; // write only
  if (inRange(offset, INTERRUPTS, INTERRUPTS + 20)) return readInterrupt(block, offset);
  if (!inRange(offset, MACHINES, INTR - 4)) return block.unsupported(`a read at offset 0x${offset.toString(16)}`);
  const place = offset - MACHINES;
  return readMachine(block, block.machines[Math.floor(place / MACHINE_STRIDE)], place % MACHINE_STRIDE);
}

function writeControl(block, value) {
  block.machines.forEach((machine, i) => {
    if ((value >>> (4 + i)) & 1) machine.restart();
    if ((value >>> (8 + i)) & 1) machine.phase = 0;
    machine.enabled = ((value >>> i) & 1) === 1;
  });
}

function writeTx(block, machine, value) {
  if (machine.tx.full) {
    block.debug |= 1 << (16 + machine.index); // TXOVER
    return;
  }
  machine.tx.push(value);
  block.fifosChanged(machine);
}

function writeMachine(block, machine, register, value) {
  switch (register) {
    case 0x00:
      machine.setDivider(value);
      break;
    case 0x04:
      machine.setExecControl(value);
      break;
    case 0x08:
      machine.setShiftControl(value);
      break;
    case 0x10:
      machine.force(value & 0xffff);
      break;
    case 0x14:
      machine.setPinControl(value);
      break;
    default: // SMx_ADDR is read only
  }
}

function writeInterrupt(block, offset, value) {
  const line = offset >= INTERRUPTS + 12 ? 1 : 0;
  const kind = ((offset - INTERRUPTS) % 12) >>> 2;
  if (kind === 0) block.enables[line] = value & 0xfff;
  if (kind === 1) block.forces[line] = value & 0xfff;
  block.linesStale = true;
}

const plainWrites = {
  [CTRL]: writeControl,
  // Write 1 to clear: the bits as written count, whatever alias they came through.
  [FDEBUG]: (block, value, raw) => (block.debug &= ~raw),
  [IRQ]: (block, value, raw) => (block.clearFlags |= raw & 0xff),
  [IRQ_FORCE]: (block, value, raw) => (block.setFlags |= raw & 0xff),
  [INPUT_SYNC_BYPASS]: (block, value) => (block.bypass = value),
};

export function writeRegister(block, offset, value, raw) {
  const plain = plainWrites[offset];
  if (plain) return plain(block, value, raw);
  if (inRange(offset, TXF, TXF + 12)) return writeTx(block, block.machines[(offset - TXF) >>> 2], value);
  if (inRange(offset, INSTR_MEM, INSTR_MEM + 124)) return (block.memory[(offset - INSTR_MEM) >>> 2] = value);
  if (inRange(offset, INTERRUPTS, INTERRUPTS + 20)) return writeInterrupt(block, offset, value);
  if (!inRange(offset, MACHINES, INTR - 4)) return block.unsupported(`a write at offset 0x${offset.toString(16)}`);
  const place = offset - MACHINES;
  return writeMachine(block, block.machines[Math.floor(place / MACHINE_STRIDE)], place % MACHINE_STRIDE, value);
}
