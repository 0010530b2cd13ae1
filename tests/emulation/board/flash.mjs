// SPDX-License-Identifier: Apache-2.0
// The flash chip behind the ROM's functions: 2 MiB as on the Pico, erased to ones by sectors of 4 KiB, programmed by pages of 256
// bytes (bits only fall), and away from the address space between flash_exit_xip and flash_enter_cmd_xip (or a second stage that is
// run again). While it is away, whatever reads it is an error.

import { qspiPads } from '../clock/registers.mjs';
import { CYCLES_PER_MICROSECOND } from '../clock/time.mjs';

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

// The serial interface to the flash chip (RP2040 data sheet, 4.10) and the chip's end of it (W25Q16JV): execute-in-place by single-bit
// 03h or by quad EBh in continuous-read mode, and the commands that a program sends by hand: status (05h, 35h), write enable (06h),
// write status (01h), identification (9Fh), unique number (4Bh). A set-up that the chip would not answer is an error at the first read.

const CONTROL0 = 0x00;
const ENABLE = 0x08;
const BAUD = 0x14;
const SER_FIFO_LEVEL = 0x20;
const RX_LEVEL = 0x24;
const STATUS = 0x28;
const DATA = 0x60;
const SPI_CONTROL0 = 0xf4;
const TMOD_EEPROM_READ = 3;
const QUAD = 2;

const STATUS_TX_READY = 0x06; // transmit FIFO not full, and empty
const STATUS_RX_READY = 0x08;
const QSPI_SELECT_CONTROL = 0x0c; // IO_QSPI: GPIO_QSPI_SS_CTRL
const OUTPUT_OVERRIDE = 8;
const DRIVE_LOW = 2;

const QUAD_ENABLED = 0x02; // of status register 2
const CONTINUOUS = 0x20; // mode bits M5-4 = 10
const CONTINUOUS_MASK = 0x30;
const ADDRESS_AND_MODE = 8; // of SPI_CTRLR0.ADDR_L: 32 bits
const QUAD_WAIT = 4;
// From the bus to the interface and back, and between two commands (chip select high).
const OVERHEAD_CYCLES = 8;

export const UNIQUE_ID = Buffer.from('e6614103e7452d2f', 'hex');
const IDENTIFICATION = Buffer.from([0xef, 0x40, 0x15]); // W25Q16

/** What the flash chip itself remembers. `quadEnabled`: the QE bit, which lasts over power-off; 'never': the chip has none. */
export class FlashChip {
  constructor({ quadEnabled = true } = {}) {
    this.hasQuad = quadEnabled !== 'never';
    this.status2 = quadEnabled === true ? QUAD_ENABLED : 0;
    this.writeEnabled = false;
    this.continuous = false; // reads begin with an address, no command
  }

  /** The byte that the chip answers at `place` (0 is the command itself). */
  answer(command, place, byte) {
    if (command === 0x06) this.writeEnabled = true;
    if (command === 0x01 && place === 2 && this.writeEnabled) [this.status2, this.writeEnabled] = [this.hasQuad ? byte : 0, false];
    if (command === 0x4b) return place >= 5 ? UNIQUE_ID[(place - 5) % 8] : 0;
    if (command === 0x9f) return place >= 1 ? (IDENTIFICATION[place - 1] ?? 0) : 0;
    if (command === 0x35) return this.status2;
    return 0; // 05h: ready
  }
}

export class Ssi {
  /** `selectControl()`: IO_QSPI's control word of the chip select; `onMapped(on)`: execute in place begins or ends. */
  constructor(selectControl, onMapped, flashChip = new FlashChip()) {
    this.selectControl = selectControl;
    this.onMapped = onMapped;
    this.flashChip = flashChip;
    this.words = new Map();
    this.received = [];
    this.place = 0;
  }

  /** As the ROM leaves it: bytes, by hand. */
  reset() {
    this.words = new Map([[CONTROL0, 7 << 16], [BAUD, 6], [ENABLE, 1]]);
    this.received = [];
    this.place = 0;
  }

  /** The chip select is held low by hand, for a command of several words. */
  get selected() {
    return ((this.selectControl() >>> OUTPUT_OVERRIDE) & 3) === DRIVE_LOW;
  }

  get format() {
    const control = this.words.get(CONTROL0) ?? 0;
    const spi = this.words.get(SPI_CONTROL0) ?? 0;
    return {
      quad: ((control >>> 21) & 3) === QUAD,
      eeprom: ((control >>> 8) & 3) === TMOD_EEPROM_READ,
      frame: ((control >>> 16) & 31) + 1,
      transfer: spi & 3,
      addressBits: 4 * ((spi >>> 2) & 15),
      commandBits: [0, 4, 8, 16][(spi >>> 8) & 3],
      waits: (spi >>> 11) & 31,
      command: spi >>> 24,
      divider: this.words.get(BAUD) ?? 0,
    };
  }

  /** Clocks of the serial bus for a word that is read in place. */
  get wordClocks() {
    const { quad, transfer, addressBits, commandBits, waits, frame } = this.format;
    const data = frame / (quad ? 4 : 1);
    const address = addressBits / (quad && transfer !== 0 ? 4 : 1);
    const command = commandBits / (quad && transfer === 2 ? 4 : 1);
    return command + address + (quad ? waits : 0) + data;
  }

  get missCycles() {
    return this.wordClocks * Math.max(2, this.format.divider) + OVERHEAD_CYCLES;
  }

  /** Why the chip would answer nonsense to a read in place, or ''. */
  get misfit() {
    const { quad, transfer, addressBits, commandBits, waits, command, frame } = this.format;
    const { status2, continuous } = this.flashChip;
    if (frame !== 32) return 'frames are not 32 bits long';
    if (!quad) {
      if (continuous) return 'a serial command reaches a chip in continuous read';
      return commandBits === 8 && addressBits === 24 && command === 3 ? '' : 'not 03h with 24 bits of address';
    }
    if (!(status2 & QUAD_ENABLED)) return "the chip's QE bit is not set";
    if (addressBits !== 4 * ADDRESS_AND_MODE || waits !== QUAD_WAIT) return 'EBh takes 32 bits of address and mode, and four clocks of wait';
    if (transfer === 1) return continuous ? 'a command reaches a chip in continuous read' : '';
    if (!continuous || commandBits !== 0) return 'no command is sent, but the chip is not in continuous read';
    return (command & CONTINUOUS_MASK) === CONTINUOUS ? '' : 'the mode bits end continuous read';
  }

  /** IO_QSPI was written: a chip select that rises ends a command. */
  selectChanged() {
    if (!this.selected) this.place = 0;
  }

  readUint32(offset) {
    if (offset === DATA) return this.received.shift() ?? 0;
    if (offset === STATUS) return STATUS_TX_READY | (this.received.length ? STATUS_RX_READY : 0);
    if (offset === RX_LEVEL) return this.received.length;
    if (offset === SER_FIFO_LEVEL) return 0;
    return this.words.get(offset) ?? 0;
  }

  writeUint32Atomic(offset, value, alias) {
    const before = alias ? this.readUint32(offset) : 0;
    this.write(offset, [value, before ^ value, before | value, before & ~value][alias] >>> 0);
  }

  write(offset, value) {
    if (offset === DATA) return this.send(value);
    this.words.set(offset, value);
    if (offset !== ENABLE) return undefined;
    this.received = [];
    this.place = 0;
    return this.onMapped(value === 1 && this.format.eeprom);
  }

  /** A word that the program sends. In quad mode it is EBh, then an address with its mode bits. */
  send(word) {
    if (this.format.quad) return this.sendQuad(word);
    // Without the chip select held, a command ends when all its answers have been read.
    if (!this.selected && this.received.length === 0) this.place = 0;
    const byte = word & 0xff;
    if (this.place === 0) this.command = byte;
    this.received.push(this.flashChip.answer(this.command, this.place++, byte));
    return undefined;
  }

  sendQuad(word) {
    if (this.place++ === 0) this.command = word & 0xff;
    else if (this.command === 0xeb && this.flashChip.status2 & QUAD_ENABLED) this.flashChip.continuous = (word & CONTINUOUS_MASK) === CONTINUOUS;
  }
}

export { QSPI_SELECT_CONTROL };
