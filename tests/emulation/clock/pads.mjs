// SPDX-License-Identifier: Apache-2.0
// The pads of bank 0: what drives each pin, what level stands on it, and what the chip's inputs see.
// rp2040js keeps outputs and inputs apart; on silicon a pin's input buffer sees whatever the pin carries.

const PINS = 30;
const FREE = 2;
const RESET_PAD = 0x56; // input enabled, 4 mA, pull-down, Schmitt trigger
const SYNCHRONISER_CYCLES = 2;

export class Pads {
  constructor(chip) {
    this.chip = chip;
    this.outside = new Uint8Array(PINS).fill(FREE);
    this.wires = []; // {from, to}
    this.levels = 0;
    this.inputs = 0;
    this.seen = 0;
    this.pending = []; // changes of `inputs` on their way through the synchroniser: {cycle, inputs}
    this.contention = new Map(); // pin -> cycle of the first time two drivers disagreed
  }

  /** Takes the pins of a freshly reset chip over; what is outside stays connected. */
  attach(gpio) {
    this.gpio = gpio;
    for (const pin of gpio) {
      pin.padValue = RESET_PAD;
      pin.checkForUpdates = () => this.update(pin.index);
      pin.refreshInput = () => this.update(pin.index);
      pin.rawInputValue = ((this.levels >>> pin.index) & 1) === 1;
    }
    this.inputs = this.levels;
    for (const pin of gpio) this.update(pin.index);
    for (const pin of gpio) pin.irqStatus = (this.inputs >>> pin.index) & 1 ? 2 : 1; // level flags only
  }

  /** Drives a pin from outside: 0, 1, or 2 to let go. */
  drive(index, level) {
    this.outside[index] = level;
    this.update(index);
  }

  /** A wire from one pin to another. */
  join(from, to) {
    this.wires.push({ from, to });
    this.update(to);
  }

  cutAll() {
    const ends = this.wires.map((wire) => wire.to);
    this.wires = [];
    for (const end of ends) this.update(end);
  }

  level(index) {
    return (this.levels >>> index) & 1;
  }

  /** The level on a pin from all that may drive it. */
  resolve(index) {
    const pin = this.gpio[index];
    const inside = pin.outputEnable && !pin.outputDisable ? +pin.outputValue : FREE;
    const outside = this.outsideLevel(index);
    if (inside !== FREE && outside !== FREE && inside !== outside && !this.contention.has(index)) {
      this.contention.set(index, this.chip.cycle);
    }
    if (inside !== FREE) return inside;
    if (outside !== FREE) return outside;
    return pin.pulldownEnabled === pin.pullupEnabled ? this.level(index) : +pin.pullupEnabled;
  }

  outsideLevel(index) {
    if (this.outside[index] !== FREE) return this.outside[index];
    const wire = this.wires.find((each) => each.to === index);
    return wire ? this.level(wire.from) : FREE;
  }

  /** Looks at a pin again after anything about it has changed. */
  update(index) {
    const level = this.resolve(index);
    const changed = level !== this.level(index);
    if (changed) {
      this.levels = (this.levels ^ (1 << index)) >>> 0;
      this.chip.recordEdge(index, level);
    }
    this.updateInput(index, level);
    if (changed) for (const wire of this.wires) if (wire.from === index) this.update(wire.to);
  }

  updateInput(index, level) {
    const pin = this.gpio[index];
    pin.rawInputValue = level === 1;
    const bit = 1 << index;
    const before = (this.inputs & bit) !== 0;
    if (pin.inputValue === before) return;
    this.inputs = (this.inputs ^ bit) >>> 0;
    this.pending.push({ cycle: this.chip.cycle, inputs: this.inputs });
    pin.setInputValue(level === 1); // edge and level interrupts of IO_BANK0
    this.chip.inputsChanged();
  }

  /** Inputs as the PIO sees them in this cycle: two cycles late, except where INPUT_SYNC_BYPASS says otherwise. */
  synchronised(cycle, bypass) {
    while (this.pending.length && this.pending[0].cycle + SYNCHRONISER_CYCLES <= cycle) this.seen = this.pending.shift().inputs;
    return ((this.seen & ~bypass) | (this.inputs & bypass)) >>> 0;
  }

  /** Cycle at which the synchronised inputs change next. */
  get nextChange() {
    return this.pending.length ? this.pending[0].cycle + SYNCHRONISER_CYCLES : Infinity;
  }

  /** After a PIO has written: looks at the pins of `mask` again. */
  updateMask(mask) {
    for (let index = 0; mask !== 0 && index < PINS; index++, mask >>>= 1) if (mask & 1) this.update(index);
  }
}
