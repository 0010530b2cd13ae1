// SPDX-License-Identifier: Apache-2.0
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
