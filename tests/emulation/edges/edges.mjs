// SPDX-License-Identifier: Apache-2.0
// Every change of every pin: cycle, GPIO, level.

import { createHash } from 'node:crypto';
import { NANOSECONDS_PER_CYCLE } from '../clock/time.mjs';

export class EdgeRecorder {
  constructor(chip) {
    this.edges = []; // {cycle, gpio, level}
    this.taken = 0;
    this.keep = true; // also what was taken
    this.initial = chip.pads.levels;
    chip.edgeListeners.add((cycle, gpio, level) => this.edges.push({ cycle, gpio, level }));
  }

  /** The edges since the last call. */
  take() {
    const fresh = this.edges.slice(this.taken);
    if (this.keep) this.taken = this.edges.length;
    else this.clear();
    return fresh;
  }

  of(gpio) {
    return this.edges.filter((edge) => edge.gpio === gpio);
  }

  clear() {
    this.edges.length = 0;
    this.taken = 0;
  }

  /** One number for a whole recording: two runs are the same if their hashes are. */
  hash() {
    const hash = createHash('sha256');
    for (const { cycle, gpio, level } of this.edges) hash.update(`${cycle} ${gpio} ${level}\n`);
    return hash.digest('hex');
  }
}

// Numbers about edges, all in cycles.

/** {count, min, max, mean, jitter} of a list; jitter is max - min. */
export function statistics(values) {
  if (values.length === 0) return { count: 0, min: NaN, max: NaN, mean: NaN, jitter: NaN };
  let [min, max, sum] = [Infinity, -Infinity, 0];
  for (const value of values) {
    min = Math.min(min, value);
    max = Math.max(max, value);
    sum += value;
  }
  return { count: values.length, min, max, mean: sum / values.length, jitter: max - min };
}

/** How long one pin stood at each level: [{level, cycles, begin}], the open end left out. */
export function levels(edges) {
  return edges.slice(1).map((edge, i) => ({ level: edges[i].level, begin: edges[i].cycle, cycles: edge.cycle - edges[i].cycle }));
}

/** Shortest stretch of one pin at `level`, or of either level. */
export function shortest(edges, level) {
  const stretches = levels(edges).filter((each) => level === undefined || each.level === level);
  return statistics(stretches.map((each) => each.cycles)).min;
}

/** From each rising edge of `from` to the first edge at `level` of `to` that follows it before the next. */
export function delays(from, to, level = 1) {
  const starts = from.filter((edge) => edge.level === 1);
  const ends = to.filter((edge) => edge.level === level);
  const result = [];
  let at = 0;
  starts.forEach((start, i) => {
    const limit = starts[i + 1]?.cycle ?? Infinity;
    while (at < ends.length && ends[at].cycle < start.cycle) at++;
    if (at < ends.length && ends[at].cycle < limit) result.push(ends[at].cycle - start.cycle);
  });
  return result;
}

// Value change dump (IEEE 1364, 18.2) of a recording, for GTKWave, PulseView and the like. Timescale 1 ns; a cycle is 8 ns.

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
