// SPDX-License-Identifier: Apache-2.0
// The emulated RP2040: rp2040js for the processor and most blocks, our own PIO, TIMER, SysTick, watchdog, pads and interrupts, and one
// clock for all of them. `cycle` counts 8 ns since power-up. See README.md for what differs from rp2040js and why.

import { RP2040 } from 'rp2040js';
import { installAccess, installInstructions } from './core/instructions.mjs';
import { PioBlock } from './pio/block.mjs';
import { repairDma, resetDma } from './dma.mjs';
import { guardMemory, XipCache } from './memory.mjs';
import { Pads } from './pads.mjs';
import { ENTRY_CYCLES, Mpu, Nvic, SysTick } from './processor.mjs';
import { EmulationFault, RegisterFile, Resets, ringOscillator, voltageRegulator } from './registers.mjs';
import { ChipEvent, dropChipAlarms, NANOSECONDS_PER_CYCLE, Scheduler } from './time.mjs';
import { Timer, Watchdog } from './timer.mjs';

const HARD_FAULT = 3;
// PSM.WDSEL bits without which a watchdog cannot restart the program: RESETS, SIO, PROC0.
const RESTART_DOMAINS = (1 << 3) | (1 << 14) | (1 << 15);

export class Chip {
  /**
   * `fastForward`: pass over stretches in which the PIO only counts (same results, tested).
   * `dmaCycles`: duration of a DMA transfer.
   * `deliverFaults`: what would be a hard fault on silicon enters the program's handler; else it ends the emulation.
   * `boot(chip)`: what the ROM does after a reset; it must set the processor's PC and SP.
   */
  constructor({ fastForward = true, dmaCycles = 1, deliverFaults = false, boot = () => {} } = {}) {
    this.boot = boot;
    this.deliverFaults = deliverFaults;
    this.dmaCycles = dmaCycles;
    this.warnings = new Map();
    this.edgeListeners = new Set();
    this.resetListeners = new Set();
    this.resetCount = 0;
    this.pads = new Pads(this);
    this.scheduler = new Scheduler(this, fastForward);
    this.build(undefined, undefined);
  }

  get cycle() {
    return this.scheduler.cycle;
  }

  get nanoseconds() {
    return this.cycle * NANOSECONDS_PER_CYCLE;
  }

  /** Builds the chip as after power-up, or, with the memories of `former`, as after a watchdog reset. */
  build(former, survivor) {
    this.rp2040 = new RP2040(former?.clock);
    this.clock = this.rp2040.clock;
    this.rp2040.logger = this.logger();
    this.rp2040.onBreak = (code) => this.onBreak(code);
    this.core = this.rp2040.core;
    this.nvic = new Nvic(this, this.core);
    this.resets = new Resets((bit) => this.resetBlock(bit));
    this.timer = new Timer(this);
    this.watchdog = new Watchdog(this, survivor);
    this.sysTick = new SysTick(this);
    this.xip = new XipCache(this);
    this.mpu = new Mpu(this);
    this.lockedUp = false;
    repairDma(this, this.rp2040.dma, this.dmaCycles);
    this.pio = [new PioBlock(this, 0), new PioBlock(this, 1)];
    this.pioPins = [0, 0];
    this.install(former);
    this.installCrystal();
    this.pads.attach(this.rp2040.gpio);
    this.scheduler.restart();
  }

  install(former) {
    const { rp2040 } = this;
    rp2040.pio = this.pio;
    Object.assign(rp2040.peripherals, {
      0x4000c: this.resets, 0x40054: this.timer, 0x40058: this.watchdog, 0x50200: this.pio[0], 0x50300: this.pio[1],
      0x14000: this.xip, 0x40018: new RegisterFile(), 0x40060: ringOscillator(), 0x40064: voltageRegulator(),
    });
    Object.defineProperty(rp2040, 'gpioValues', { get: () => this.pads.inputs });
    this.installSystemBlock(rp2040.ppb);
    if (former) this.inherit(former);
    guardMemory(this, rp2040);
    this.access = installAccess(this, rp2040);
    this.plainInstruction = installInstructions(this.core); // rp2040js' own, for comparison
  }

  /** XOSC.STATUS: stable, as long as there is a crystal. SYSINFO.CHIP_ID: an RP2040 B2. */
  installCrystal() {
    const { peripherals } = this.rp2040;
    const oscillator = peripherals[0x40024];
    const read = oscillator.readUint32.bind(oscillator);
    oscillator.readUint32 = (offset) => (offset === 4 && this.crystalStopped ? 0 : read(offset));
    peripherals[0x40000] = new RegisterFile({ 0: 0x20002927 });
  }

  /** What a watchdog reset leaves alone: SRAM, flash, the USB memory. */
  inherit(former) {
    const { rp2040 } = this;
    rp2040.sram.set(former.sram);
    rp2040.usbDPRAM.set(former.usbDPRAM);
    Object.assign(rp2040, { flash: former.flash, flash16: former.flash16, flashView: former.flashView, bootrom: former.bootrom });
  }

  installSystemBlock(ppb) {
    const read = ppb.readUint32.bind(ppb);
    const write = ppb.writeUint32.bind(ppb);
    const isSysTick = (offset) => offset >= 0x10 && offset <= 0x1c;
    ppb.systickTimer.enable = false;
    ppb.readUint32 = (offset) => {
      if (isSysTick(offset)) return this.sysTick.read(offset);
      return this.mpu.handles(offset) ? this.mpu.read(offset) >>> 0 : read(offset);
    };
    ppb.writeUint32 = (offset, value) => {
      if (isSysTick(offset)) this.sysTick.write(offset, value >>> 0);
      else if (this.mpu.handles(offset)) this.mpu.write(offset, value >>> 0);
      else if (!this.nvic.writeRegister(offset, value)) write(offset, value);
    };
  }

  /** rp2040js' complaints: what it cannot do is an error here, the rest is counted. */
  logger() {
    const note = (name, text) => {
      if (/not implemented|invalid memory|undefined address|nimplemented peripheral|aligned/.test(text)) this.fault(`${name}: ${text}`);
      this.warnings.set(`${name}: ${text}`, (this.warnings.get(`${name}: ${text}`) ?? 0) + 1);
    };
    return { debug() {}, info() {}, warn: note, error: note };
  }

  fault(what) {
    throw new EmulationFault(what, { cycle: this.cycle, pc: this.core?.PC ?? 0 });
  }

  /** An instruction at `pc` faulted: the hard fault handler, or lock-up if that is where it was (ARMv6-M, B1.5.6 and B1.5.15). */
  hardFault(error, pc) {
    if (!this.deliverFaults || error.name !== 'EmulationFault') throw error;
    const { core } = this;
    this.lastFault = error.message;
    try {
      if (core.IPSR === HARD_FAULT) throw error;
      core.registers[15] = pc;
      core.exceptionEntry(HARD_FAULT);
    } catch {
      this.lockedUp = true;
    }
    return ENTRY_CYCLES;
  }

  onBreak(code) {
    this.fault(`breakpoint ${code}`);
  }

  /** Runs the given number of cycles; ends early, with true, once `until()` holds. */
  run(cycles, until) {
    return this.scheduler.run(cycles, until);
  }

  // What the blocks ask for.
  /**
   * The crystal stops for good: no tick for watchdog and TIMER, and no start of it after a reset. The PLL without its reference goes on
   * at some frequency (here: the same), and so do processor, SysTick, PIO and DMA.
   */
  stopCrystal() {
    this.crystalStopped = true;
    this.watchdog.stopTick();
    this.timer.setTicking(false);
  }

  createEvent(callback) {
    return new ChipEvent(this.clock, callback, false);
  }

  /** An event of the world outside: it outlives resets. */
  createOutsideEvent(callback) {
    return new ChipEvent(this.clock, callback, true);
  }

  setInterrupt(irq, level) {
    this.nvic.setLine(irq, level);
  }

  setDreq(channel, wanted) {
    const { dma } = this.rp2040;
    if (wanted) dma.setDREQ(channel);
    else dma.clearDREQ(channel);
  }

  pendSysTick() {
    this.core.pendingSystick = true;
    this.core.interruptsUpdated = true;
  }

  spend(cycles) {
    this.scheduler.debt += cycles;
  }

  settle() {
    this.scheduler.settle();
  }

  disturb() {
    this.scheduler.disturb();
  }

  inputsChanged() {
    this.scheduler.inputsChanged();
  }

  recordEdge(gpio, level) {
    for (const listener of this.edgeListeners) listener(this.cycle, gpio, level);
  }

  /** Takes what the PIO blocks drive now to the pads. */
  pinsChanged() {
    let mask = 0;
    this.pio?.forEach((block, i) => {
      const [values, directions] = this.pioPins[i] || [0, 0];
      if (values === block.values && directions === block.directions) return;
      mask |= (values ^ block.values) | (directions ^ block.directions);
      this.pioPins[i] = [block.values, block.directions];
    });
    if (mask) this.pads.updateMask(mask >>> 0);
  }

  /** Takes one exception if it is due; true if the processor is now in a handler. */
  takeException() {
    if (!this.core.checkForInterrupts()) return false;
    this.spend(ENTRY_CYCLES);
    return true;
  }

  /** RESETS: one block back to its reset values. */
  resetBlock(bit) {
    const { rp2040 } = this;
    if (bit === 10 || bit === 11) {
      this.disturb();
      this.pio[bit - 10].reset();
      this.pinsChanged();
    }
    if (bit === 2) resetDma(rp2040.dma);
    if (bit === 21) this.timer.reset();
    if (bit === 5) for (const pin of rp2040.gpio) this.resetPin(pin);
    if (bit === 8) this.pads.attach(rp2040.gpio);
    if (bit === 24) this.usbReset?.();
  }

  resetPin(pin) {
    Object.assign(pin, { ctrl: 0x1f, irqEnableMask: 0, irqForceMask: 0 });
    pin.checkForUpdates();
    this.rp2040.updateIOInterrupt();
  }

  /** The watchdog has fired: the reset itself waits for the end of the instruction. */
  requestReset(survivor) {
    this.resetRequest ??= survivor;
  }

  performReset() {
    const survivor = this.resetRequest;
    this.resetRequest = undefined;
    const psm = this.rp2040.peripherals[0x40010];
    if ((psm.wdsel & RESTART_DOMAINS) !== RESTART_DOMAINS) {
      this.fault('the watchdog fired, but PSM.WDSEL does not select RESETS, SIO and PROC0');
    }
    dropChipAlarms(this.clock);
    this.resetCount++;
    this.build(this.rp2040, survivor);
    for (const listener of this.resetListeners) listener(this);
    this.boot(this);
  }
}
