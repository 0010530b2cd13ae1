// SPDX-License-Identifier: Apache-2.0
// A chip with its processor asleep, whose registers a test writes itself: PIO programs without any machine code.

import { Chip } from '../clock/chip.mjs';
import { EdgeRecorder } from '../edges/edges.mjs';

export const RESETS = 0x4000c000;
export const IO_BANK0 = 0x40014000;
export const PADS_BANK0 = 0x4001c000;
export const DMA = 0x50000000;
export const PIO = [0x50200000, 0x50300000];
export const CTRL = 0x00;
export const FSTAT = 0x04;
export const FDEBUG = 0x08;
export const FLEVEL = 0x0c;
export const TXF = 0x10;
export const RXF = 0x20;
export const IRQ = 0x30;
export const IRQ_FORCE = 0x34;
export const SYNC_BYPASS = 0x38;
export const MACHINE = { clkdiv: 0xc8, exec: 0xcc, shift: 0xd0, address: 0xd4, instruction: 0xd8, pins: 0xdc };

const STRIDE = 0x18;
const FUNCTION_PIO = 6;
const SHIFT_RESET = 0x000c0000;

export const TX_STALL = (machine) => 1 << (24 + machine);
export const TX_OVER = (machine) => 1 << (16 + machine);
export const RX_UNDER = (machine) => 1 << (8 + machine);
export const RX_STALL = (machine) => 1 << machine;

export class Bench {
  constructor({ fastForward = true } = {}) {
    this.chip = new Chip({ fastForward });
    this.chip.core.waiting = true;
    this.recorder = new EdgeRecorder(this.chip);
    this.write(RESETS, 0);
  }

  read(address) {
    return this.chip.rp2040.readUint32(address) >>> 0;
  }

  write(address, value) {
    this.chip.rp2040.writeUint32(address, value >>> 0);
  }

  pio(offset, block = 0) {
    return this.read(PIO[block] + offset);
  }

  setPio(offset, value, block = 0) {
    this.write(PIO[block] + offset, value);
  }

  machine(register, machine = 0, block = 0) {
    return this.pio(MACHINE[register] + STRIDE * machine, block);
  }

  setMachine(register, value, machine = 0, block = 0) {
    this.setPio(MACHINE[register] + STRIDE * machine, value, block);
  }

  /** Gives pins to a PIO block and makes them outputs through forced instructions of its machine 3. */
  outputs(gpios, block = 0) {
    for (const gpio of gpios) {
      this.write(IO_BANK0 + 8 * gpio + 4, FUNCTION_PIO + block);
      this.setMachine('pins', (1 << 26) | (gpio << 5), 3, block);
      this.force('set pindirs, 1', 3, block);
    }
  }

  force(line, machine = 0, block = 0) {
    this.setMachine('instruction', assemble(line)[0], machine, block);
  }

  /** Loads a program and sets a machine up for it, stopped at its begin. */
  load(text, { machine = 0, block = 0, origin = 0, clkdiv = 0x10000, exec = 0, shift = SHIFT_RESET, pins = 0, wrap, ...assembly } = {}) {
    const words = assemble(text, { origin, ...assembly });
    words.forEach((word, i) => this.setPio(0x48 + 4 * (origin + i), word, block));
    const [bottom, top] = wrap ?? [origin, origin + words.length - 1];
    this.setMachine('clkdiv', clkdiv, machine, block);
    this.setMachine('exec', exec | (top << 12) | (bottom << 7), machine, block);
    this.setMachine('shift', shift, machine, block);
    this.setMachine('pins', pins, machine, block);
    this.force(`jmp ${origin}`, machine, block);
  }

  /** Starts and stops machines; with `restart` also SM_RESTART and CLKDIV_RESTART of all. */
  enable(mask, { block = 0, restart = false } = {}) {
    this.setPio(CTRL, mask | (restart ? 0xff0 : 0), block);
  }

  put(value, machine = 0, block = 0) {
    this.setPio(TXF + 4 * machine, value, block);
  }

  get(machine = 0, block = 0) {
    return this.pio(RXF + 4 * machine, block);
  }

  run(cycles) {
    this.chip.run(cycles);
  }

  drive(gpio, level) {
    this.chip.pads.drive(gpio, level);
  }

  levelsOf(gpio) {
    const edges = this.recorder.of(gpio);
    return edges.slice(1).map((edge, i) => (edges[i].level ? edge.cycle - edges[i].cycle : edges[i].cycle - edge.cycle));
  }
}

export const pinsOf = ({ out = 0, outCount = 0, set = 0, setCount = 0, side = 0, sideCount = 0, input = 0 }) =>
  (out | (set << 5) | (side << 10) | (input << 15) | (outCount << 20) | (setCount << 26) | (sideCount << 29)) >>> 0;

export const shiftOf = ({ autopush = false, autopull = false, inRight = true, outRight = true, push = 0, pull = 0, joinTx = false, joinRx = false }) =>
  ((autopush << 16) | (autopull << 17) | (inRight << 18) | (outRight << 19) | (push << 20) | (pull << 25) | (joinTx << 30) | (joinRx << 31)) >>> 0;

export const execOf = ({ statusLevel = 0, statusRx = false, jumpPin = 0, sideOptional = false, sideDirections = false }) =>
  (statusLevel | (statusRx << 4) | (jumpPin << 24) | (sideOptional << 30) | (sideDirections << 29)) >>> 0;

// A small PIO assembler for tests: the data sheet's syntax (3.3), one instruction a line, `label:` lines, `side N`, `[delay]`.

const JUMPS = { '': 0, '!x': 1, 'x--': 2, '!y': 3, 'y--': 4, 'x!=y': 5, pin: 6, '!osre': 7 };
const WAITS = { gpio: 0, pin: 1, irq: 2 };
const IN_SOURCES = { pins: 0, x: 1, y: 2, null: 3, isr: 6, osr: 7 };
const OUT_TARGETS = { pins: 0, x: 1, y: 2, null: 3, pindirs: 4, pc: 5, isr: 6, exec: 7 };
const MOV_TARGETS = { pins: 0, x: 1, y: 2, exec: 4, pc: 5, isr: 6, osr: 7 };
const MOV_SOURCES = { pins: 0, x: 1, y: 2, null: 3, status: 5, isr: 6, osr: 7 };
const SET_TARGETS = { pins: 0, x: 1, y: 2, pindirs: 4 };

function pick(table, name, line) {
  if (!(name in table)) throw new Error(`'${name}' in '${line}'`);
  return table[name];
}

const irqField = (number, relative) => (Number(number) & 7) | (relative ? 0x10 : 0);

const encoders = {
  jmp: ([first, second], { labels, line }) => {
    const [condition, target] = second === undefined ? ['', first] : [first, second];
    return (pick(JUMPS, condition, line) << 5) | (labels[target] ?? Number(target));
  },
  wait: ([polarity, source, index, relative], { line }) => {
    const kind = pick(WAITS, source, line);
    return 0x2000 | (Number(polarity) << 7) | (kind << 5) | (kind === 2 ? irqField(index, relative === 'rel') : Number(index));
  },
  in: ([source, count], { line }) => 0x4000 | (pick(IN_SOURCES, source, line) << 5) | (Number(count) & 31),
  out: ([target, count], { line }) => 0x6000 | (pick(OUT_TARGETS, target, line) << 5) | (Number(count) & 31),
  push: (words) => 0x8000 | (words.includes('iffull') << 6) | (!words.includes('noblock') << 5),
  pull: (words) => 0x8080 | (words.includes('ifempty') << 6) | (!words.includes('noblock') << 5),
  mov: ([target, source], { line }) => {
    const operation = { '!': 1, '~': 1, ':': 2 }[source[0]] ?? 0;
    const name = source.replace(/^(!|~|::)/, '');
    return 0xa000 | (pick(MOV_TARGETS, target, line) << 5) | (operation << 3) | pick(MOV_SOURCES, name, line);
  },
  irq: (words) => {
    const numbers = words.filter((word) => /^\d+$/.test(word));
    return 0xc000 | (words.includes('clear') << 6) | (words.includes('wait') << 5) | irqField(numbers[0], words.includes('rel'));
  },
  set: ([target, value], { line }) => 0xe000 | (pick(SET_TARGETS, target, line) << 5) | (Number(value) & 31),
  nop: () => 0xa042,
};

function delayAndSide(line, { sideBits = 0, sideOptional = false }) {
  const delay = Number(/\[(\d+)\]/.exec(line)?.[1] ?? 0);
  const side = /\bside\s+(\d+)/.exec(line)?.[1];
  const width = sideBits + (sideOptional ? 1 : 0);
  if (sideBits && !sideOptional && side === undefined) throw new Error(`no side-set in '${line}'`);
  if (delay >= 1 << (5 - width)) throw new Error(`delay too long in '${line}'`);
  const enable = sideOptional && side !== undefined ? 1 << sideBits : 0;
  return (((enable | Number(side ?? 0)) << (5 - width)) | delay) << 8;
}

/** The words of a program. `sideBits`: side-set pins; `sideOptional`: with `opt`. Labels are relative to `origin`. */
export function assemble(text, { origin = 0, ...options } = {}) {
  const labels = {};
  const lines = [];
  for (const raw of text.split('\n')) {
    const line = raw.replace(/;.*/, '').trim();
    if (line === '') continue;
    const label = /^(\w+):$/.exec(line)?.[1];
    if (label) labels[label] = origin + lines.length;
    else lines.push(line);
  }
  return lines.map((line) => {
    const [name, ...words] = line.replace(/\[.*\]/, '').replace(/\bside\s+\d+/, '').split(/[\s,]+/).filter(Boolean);
    if (!encoders[name]) throw new Error(`no instruction '${line}'`);
    return encoders[name](words, { labels, line }) | delayAndSide(line, options);
  });
}
