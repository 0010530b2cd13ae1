// SPDX-License-Identifier: Apache-2.0
// What happens to the board's pins from outside: levels, wires, a periodic pulse such as VSYNC, a simple camera.

import { NANOSECONDS_PER_CYCLE } from '../clock/time.mjs';

const LET_GO = 2;
const toCycles = (nanoseconds) => Math.round(nanoseconds / NANOSECONDS_PER_CYCLE);

export class Stimuli {
  constructor(chip) {
    this.chip = chip;
    this.pulses = new Map(); // gpio -> {event, ...}
  }

  /** Levels, wires and pulses of another board's surroundings; pulses begin anew. Cameras do not come along. */
  inherit(former, exceptPin) {
    former.chip.pads.outside.forEach((level, gpio) => gpio !== exceptPin && this.drive(gpio, level));
    for (const { from, to } of former.chip.pads.wires) this.wire(from, to);
    for (const [gpio, { period, width }] of former.pulses) this.pulse(gpio, period, width);
  }

  drive(gpio, level) {
    this.chip.pads.drive(gpio, level);
  }

  wire(from, to) {
    this.chip.pads.join(from, to);
  }

  cutWires() {
    this.chip.pads.cutAll();
  }

  /** One change of level at a cycle to come. */
  driveAt(cycle, gpio, level) {
    this.chip.createOutsideEvent(() => this.drive(gpio, level)).at(cycle);
  }

  /**
   * High for `width` nanoseconds every `period`, first one period from now (both to the nearest cycle); a period of 0 stops it.
   * The period is not rounded from pulse to pulse: the n-th begins at round(n * period).
   */
  pulse(gpio, period, width) {
    this.pulses.get(gpio)?.event.cancel();
    this.pulses.delete(gpio);
    if (period === 0) return this.drive(gpio, LET_GO);
    this.drive(gpio, 0);
    const state = { begin: this.chip.cycle, count: 1, high: false, period, width };
    state.event = this.chip.createOutsideEvent(() => this.pulseEdge(gpio, state, period, width));
    this.pulses.set(gpio, state);
    return state.event.at(state.begin + toCycles(period));
  }

  pulseEdge(gpio, state, period, width) {
    state.high = !state.high;
    this.drive(gpio, +state.high);
    const rise = state.begin + toCycles(state.count * period);
    if (state.high) return state.event.at(rise + Math.max(1, toCycles(width)));
    state.count++;
    const next = state.begin + toCycles(state.count * period);
    return state.event.at(Math.max(next, this.chip.cycle + 1));
  }

  /** A camera: its strobe is high from `delay` after each rising edge of the trigger, for `width` nanoseconds. */
  camera(trigger, strobe, delay, width) {
    this.drive(strobe, 0);
    this.chip.edgeListeners.add((cycle, gpio, level) => {
      if (gpio !== trigger || level !== 1) return;
      const begin = cycle + Math.max(1, toCycles(delay));
      this.driveAt(begin, strobe, 1);
      this.driveAt(begin + Math.max(1, toCycles(width)), strobe, 0);
    });
  }
}
