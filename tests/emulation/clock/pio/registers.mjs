// SPDX-License-Identifier: Apache-2.0
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
