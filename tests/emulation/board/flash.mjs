// SPDX-License-Identifier: Apache-2.0
// The flash chip behind the ROM's functions: 2 MiB as on the Pico, erased to ones by sectors of 4 KiB, programmed by pages of 256
// bytes (bits only fall), and away from the address space between flash_exit_xip and flash_enter_cmd_xip (or a second stage that is
// run again). While it is away, whatever reads it is an error.

import { CYCLES_PER_MICROSECOND } from '../clock/constants.mjs';
import { qspiPads } from '../clock/registers.mjs';
import { FlashChip, QSPI_SELECT_CONTROL, Ssi } from './ssi.mjs';

export const FLASH_BYTES = 2 << 20;
const SECTOR = 4096;
const PAGE = 256;
// Typical times of the W25Q16JV.
const SECTOR_ERASE_CYCLES = 45_000 * CYCLES_PER_MICROSECOND;
const PAGE_PROGRAM_CYCLES = 400 * CYCLES_PER_MICROSECOND;

const inFlash = (address) => address >>> 26 === 4; // 0x10 to 0x13: the four aliases

export class Flash {
  /** `quadEnabled`: the QE bit of a fresh chip. `missCycles`: instead of what the serial interface takes for a word. */
  constructor(chip, { quadEnabled = true, missCycles } = {}) {
    this.chip = chip;
    this.flashChip = new FlashChip({ quadEnabled });
    this.missCycles = missCycles;
    this.erased = 0; // sectors
    this.programmed = 0; // pages
  }

  /** Connects a (new) chip's serial interface. After a reset flash is there: the ROM saw to that. */
  install() {
    const { peripherals } = this.chip.rp2040;
    const pins = peripherals[0x40018];
    const ssi = new Ssi(() => pins.readUint32(QSPI_SELECT_CONTROL), (on) => this.map(on), this.flashChip);
    this.ssi = ssi;
    const write = pins.writeUint32Atomic.bind(pins);
    pins.writeUint32Atomic = (offset, value, alias) => {
      write(offset, value, alias);
      if (offset === QSPI_SELECT_CONTROL) ssi.selectChanged();
    };
    peripherals[0x18000] = ssi;
    this.connect();
    this.flashChip.continuous = false; // the ROM's way out of it
    this.chip.xip.missCycles = () => this.wordCycles();
    this.mapped = true;
  }

  /** Cycles for a word that the cache does not have. */
  wordCycles() {
    if (!this.mapped) this.fault('a read in place while it is not mapped');
    if (this.ssi.misfit) this.fault(`a read in place: ${this.ssi.misfit}`);
    return this.missCycles ?? this.ssi.missCycles;
  }

  /** Execute in place on or off. */
  map(on) {
    if (on === this.mapped) return;
    this.mapped = on;
    const { rp2040, access } = this.chip;
    access.direct = on;
    for (const name of ['readUint8', 'readUint16', 'readUint32']) {
      if (on) delete rp2040[name];
      else this.guard(rp2040, name);
    }
  }

  guard(rp2040, name) {
    const read = rp2040[name].bind(rp2040);
    rp2040[name] = (address) => {
      if (inFlash(address)) this.fault(`a read at 0x${(address >>> 0).toString(16)} while it is not mapped`);
      return read(address);
    };
  }

  get bytes() {
    return this.chip.rp2040.flash;
  }

  /** The ROM's functions, by their codes. */
  functions() {
    return {
      IF: () => {
        this.checkCaller('connect_internal_flash');
        this.connect();
      },
      EX: () => {
        this.checkCaller('flash_exit_xip');
        this.flashChip.continuous = false;
        this.ssi.reset();
        this.map(false);
      },
      RE: ([offset, count]) => this.erase(offset, count),
      RP: ([offset, source, count]) => this.program(offset, source, count),
      FC: () => {
        this.checkCaller('flash_flush_cache');
        this.chip.xip.flush();
      },
      CX: () => this.enterCommandXip(),
    };
  }

  /** connect_internal_flash: the pads' defaults; a fast second stage must set them up again. */
  connect() {
    this.chip.rp2040.peripherals[0x40020] = qspiPads();
  }

  /** flash_enter_cmd_xip: the ROM's slow way, 03h at a sixth of the clock (data sheet, 2.8.3.1.3). */
  enterCommandXip() {
    this.ssi.words.set(0x00, (31 << 16) | (3 << 8));
    this.ssi.words.set(0x14, 6);
    this.ssi.words.set(0xf4, (0x03 << 24) | (2 << 8) | (6 << 2));
    this.map(true);
  }

  fault(what) {
    this.chip.fault(`flash: ${what}`);
  }

  /** While the flash is away from the address space nothing may be fetched from it. */
  checkCaller(name) {
    if (inFlash(this.chip.core.LR)) this.fault(`${name} is called from code in flash`);
  }

  checkInterrupts(name) {
    const { core, rp2040 } = this.chip;
    if (core.PM || core.enabledInterrupts === 0) return;
    if (inFlash(core.VTOR)) this.fault(`${name} with interrupts on and their table in flash`);
    for (let irq = 0; irq < 26; irq++) {
      const enabled = (core.enabledInterrupts >>> irq) & 1;
      if (enabled && inFlash(rp2040.readUint32(core.VTOR + 64 + 4 * irq))) this.fault(`${name} with interrupt ${irq} on, whose handler is in flash`);
    }
  }

  check(name, offset, count, unit) {
    this.checkCaller(name);
    this.checkInterrupts(name);
    if (this.mapped) this.fault(`${name} without flash_exit_xip before`);
    if (offset % unit || count % unit) this.fault(`${name}(${offset}, ${count}): not a multiple of ${unit}`);
    if (offset + count > FLASH_BYTES) this.fault(`${name}(${offset}, ${count}) is beyond the end of ${FLASH_BYTES} bytes`);
  }

  erase(offset, count) {
    this.check('flash_range_erase', offset, count, SECTOR);
    this.bytes.fill(0xff, offset, offset + count);
    this.erased += count / SECTOR;
    this.chip.spend((count / SECTOR) * SECTOR_ERASE_CYCLES);
  }

  program(offset, source, count) {
    this.check('flash_range_program', offset, count, PAGE);
    if (inFlash(source)) this.fault('flash_range_program from data in flash');
    for (let i = 0; i < count; i++) this.bytes[offset + i] &= this.chip.rp2040.readUint8(source + i);
    this.programmed += count / PAGE;
    this.chip.spend((count / PAGE) * PAGE_PROGRAM_CYCLES);
  }
}
