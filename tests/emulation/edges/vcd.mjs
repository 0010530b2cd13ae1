// SPDX-License-Identifier: Apache-2.0
// Value change dump (IEEE 1364, 18.2) of a recording, for GTKWave, PulseView and the like. Timescale 1 ns; a cycle is 8 ns.

import { NANOSECONDS_PER_CYCLE } from '../clock/constants.mjs';

const code = (index) => String.fromCharCode(33 + index);

/**
 * `edges`: {cycle, gpio, level} in order of time; `names`: GPIO number -> name of each signal to write;
 * `initial`: bit mask of the levels before the first edge.
 */
export function vcd(edges, names, initial = 0) {
  const gpios = Object.keys(names).map(Number).sort((a, b) => a - b);
  const codes = new Map(gpios.map((gpio, i) => [gpio, code(i)]));
  const lines = ['$timescale 1 ns $end', '$scope module board $end'];
  for (const gpio of gpios) lines.push(`$var wire 1 ${codes.get(gpio)} ${names[gpio].replace(/\s/g, '_')} $end`);
  lines.push('$upscope $end', '$enddefinitions $end', '#0', '$dumpvars');
  for (const gpio of gpios) lines.push(`${(initial >>> gpio) & 1}${codes.get(gpio)}`);
  lines.push('$end');
  let last = 0;
  for (const { cycle, gpio, level } of edges) {
    if (!codes.has(gpio)) continue;
    if (cycle !== last) lines.push(`#${cycle * NANOSECONDS_PER_CYCLE}`);
    last = cycle;
    lines.push(`${level}${codes.get(gpio)}`);
  }
  return `${lines.join('\n')}\n`;
}

/** GPIO0..29 by their numbers, with better names where given. */
export function pinNames(names = {}) {
  return Object.fromEntries(Array.from({ length: 30 }, (_, gpio) => [gpio, names[gpio] ?? `GPIO${gpio}`]));
}
