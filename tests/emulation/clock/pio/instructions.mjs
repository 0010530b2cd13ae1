// SPDX-License-Identifier: Apache-2.0
// The nine PIO instructions (RP2040 data sheet, 3.4). Each returns true when done and false when it stalls.

const PINS = 0;
const rotateRight = (value, by) => ((value >>> by) | (by ? value << (32 - by) : 0)) >>> 0;
const lowBits = (value, count) => (count >= 32 ? value : value & ((1 << count) - 1)) >>> 0;

/** IRQ number of an instruction: with bit 4 the low two bits are relative to the state machine. */
export function irqNumber(machine, field) {
  return field & 0x10 ? (field & 4) | ((field + machine.index) & 3) : field & 7;
}

export function reverseBits(value) {
  let result = 0;
  for (let bit = 0; bit < 32; bit++) result |= ((value >>> bit) & 1) << (31 - bit);
  return result >>> 0;
}

const conditions = [
  () => true,
  (m) => m.x === 0,
  (m) => {
    const taken = m.x !== 0;
    m.x = (m.x - 1) >>> 0;
    return taken;
  },
  (m) => m.y === 0,
  (m) => {
    const taken = m.y !== 0;
    m.y = (m.y - 1) >>> 0;
    return taken;
  },
  (m) => m.x !== m.y,
  (m) => ((m.block.inputs >>> m.exec.jumpPin) & 1) === 1,
  (m) => m.osrCount < m.shift.pullThreshold,
];

function jumpTo(m, address) {
  m.pc = address & 31;
  m.jumped = true;
}

function jump(m, opcode) {
  if (conditions[(opcode >>> 5) & 7](m)) jumpTo(m, opcode);
  return true;
}

/** Level or flag that a WAIT looks at now: 0 or 1. */
export function waitedFor(m, opcode) {
  const source = (opcode >>> 5) & 3;
  const index = opcode & 31;
  if (source === 0) return (m.block.inputs >>> index) & 1;
  if (source === 1) return (m.block.inputs >>> ((index + m.pins.inBase) & 31)) & 1;
  if (source === 2) return (m.block.irq >>> irqNumber(m, index)) & 1;
  return m.block.unsupported('WAIT from source 3');
}

function wait(m, opcode) {
  const polarity = (opcode >>> 7) & 1;
  if (waitedFor(m, opcode) !== polarity) return false;
  if (((opcode >>> 5) & 3) === 2 && polarity) m.block.clearIrq(irqNumber(m, opcode & 31));
  return true;
}

const sources = [
  (m) => rotateRight(m.block.inputs, m.pins.inBase),
  (m) => m.x,
  (m) => m.y,
  () => 0,
  (m) => m.block.unsupported('source 4'),
  (m) => m.status,
  (m) => m.isr,
  (m) => m.osr,
];

function shiftIn(m, value, count) {
  if (count === 32) m.isr = value;
  else if (m.shift.inRight) m.isr = ((m.isr >>> count) | (value << (32 - count))) >>> 0;
  else m.isr = ((m.isr << count) | value) >>> 0;
  m.isrCount = Math.min(32, m.isrCount + count);
}

function pushWord(m) {
  m.rx.push(m.isr);
  m.isr = 0;
  m.isrCount = 0;
  m.block.fifosChanged(m);
}

/** IN. With autopush a full FIFO stalls it; nothing is shifted until there is room, which gives the same words. */
function shiftInstruction(m, opcode) {
  const count = opcode & 31 || 32;
  const pushes = m.shift.autopush && m.isrCount + count >= m.shift.pushThreshold;
  if (pushes && m.rx.full) return m.block.rxStall(m);
  shiftIn(m, lowBits(sources[(opcode >>> 5) & 7](m), count), count);
  if (pushes) pushWord(m);
  return true;
}

const destinations = [
  (m, value) => m.block.writePins(m.pins.outBase, m.pins.outCount, value),
  (m, value) => (m.x = value),
  (m, value) => (m.y = value),
  () => {},
  (m, value) => m.block.writeDirections(m.pins.outBase, m.pins.outCount, value),
  (m, value) => jumpTo(m, value),
  (m, value, count) => {
    m.isr = value;
    m.isrCount = count;
  },
  (m, value) => (m.nextLatch = value & 0xffff),
];

function shiftOut(m, count) {
  const value = m.shift.outRight ? lowBits(m.osr, count) : m.osr >>> (32 - count);
  if (count === 32) m.osr = 0;
  else m.osr = (m.shift.outRight ? m.osr >>> count : m.osr << count) >>> 0;
  m.osrCount = Math.min(32, m.osrCount + count);
  return value >>> 0;
}

/** OUT. With autopull an OSR that is used up is filled in this cycle but shifted out only in the next. */
function out(m, opcode) {
  const count = opcode & 31 || 32;
  if (m.shift.autopull && m.osrCount >= m.shift.pullThreshold) {
    if (m.tx.empty) return m.block.txStall(m);
    m.pullWord();
    return false;
  }
  destinations[(opcode >>> 5) & 7](m, shiftOut(m, count), count);
  m.refill();
  return true;
}

function push(m, opcode) {
  const onlyIfFull = (opcode >>> 6) & 1;
  const block = (opcode >>> 5) & 1;
  if (onlyIfFull && m.isrCount < m.shift.pushThreshold) return true;
  if (!m.rx.full) {
    pushWord(m);
    return true;
  }
  m.block.rxStall(m);
  if (block) return false;
  m.isr = 0;
  m.isrCount = 0;
  return true;
}

/** PULL. With autopull it is a fence: nothing to do if the OSR is full. */
function pull(m, opcode) {
  const onlyIfEmpty = (opcode >>> 6) & 1;
  const block = (opcode >>> 5) & 1;
  if (onlyIfEmpty && m.osrCount < m.shift.pullThreshold) return true;
  if (m.shift.autopull && m.osrCount === 0) return true;
  if (!m.tx.empty) {
    m.pullWord();
    return true;
  }
  if (block) return m.block.txStall(m);
  m.osr = m.x;
  m.osrCount = 0;
  return true;
}

const pushOrPull = (m, opcode) => (opcode & 0x80 ? pull(m, opcode) : push(m, opcode));

const operations = [(v) => v, (v) => ~v >>> 0, reverseBits, (v, m) => m.block.unsupported('MOV operation 3')];

const moves = [
  destinations[PINS],
  destinations[1],
  destinations[2],
  (m) => m.block.unsupported('MOV to destination 3'),
  (m, value) => (m.nextLatch = value & 0xffff),
  (m, value) => jumpTo(m, value),
  (m, value) => {
    m.isr = value;
    m.isrCount = 0;
  },
  (m, value) => {
    m.osr = value;
    m.osrCount = 0;
  },
];

function move(m, opcode) {
  const value = operations[(opcode >>> 3) & 3](sources[opcode & 7](m), m);
  moves[(opcode >>> 5) & 7](m, value);
  return true;
}

/** IRQ: sets or clears a flag; with Wait it stalls from then on until someone has cleared it. */
function irq(m, opcode) {
  const number = irqNumber(m, opcode & 31);
  if (opcode & 0x40) {
    m.block.clearIrq(number);
    return true;
  }
  if (m.irqWaiting) {
    m.irqWaiting = ((m.block.irq >>> number) & 1) === 1;
    return !m.irqWaiting;
  }
  m.block.setIrq(number);
  m.irqWaiting = (opcode & 0x20) !== 0;
  return !m.irqWaiting;
}

const setters = {
  0: (m, value) => m.block.writePins(m.pins.setBase, m.pins.setCount, value),
  1: (m, value) => (m.x = value),
  2: (m, value) => (m.y = value),
  4: (m, value) => m.block.writeDirections(m.pins.setBase, m.pins.setCount, value),
};

function set(m, opcode) {
  const setter = setters[(opcode >>> 5) & 7];
  if (!setter) return m.block.unsupported('SET to this destination');
  setter(m, opcode & 31);
  return true;
}

const classes = [jump, wait, shiftInstruction, out, pushOrPull, move, irq, set];

export function execute(machine, opcode) {
  return classes[opcode >>> 13](machine, opcode);
}
