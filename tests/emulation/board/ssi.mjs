// SPDX-License-Identifier: Apache-2.0
// The serial interface to the flash chip (RP2040 data sheet, 4.10): registers that keep what is written, execute-in-place on or off,
// and the few commands that a program sends by hand: read status (05h, 35h), identification (9Fh), unique number (4Bh).

const ENABLE = 0x08;
const SER_FIFO_LEVEL = 0x20;
const RX_LEVEL = 0x24;
const STATUS = 0x28;
const DATA = 0x60;
const CONTROL0 = 0x00;
const TMOD_EEPROM_READ = 3;

const STATUS_TX_READY = 0x06; // transmit FIFO not full, and empty
const STATUS_RX_READY = 0x08;
const QSPI_SELECT_CONTROL = 0x0c; // IO_QSPI: GPIO_QSPI_SS_CTRL
const OUTPUT_OVERRIDE = 8;
const DRIVE_LOW = 2;

export const UNIQUE_ID = Buffer.from('e6614103e7452d2f', 'hex');
const IDENTIFICATION = Buffer.from([0xef, 0x40, 0x15]); // W25Q16

/** Byte that the chip answers at `place` (0 is the command itself) of a command. */
function answer(command, place) {
  if (command === 0x4b) return place >= 5 ? UNIQUE_ID[(place - 5) % 8] : 0;
  if (command === 0x9f) return place >= 1 ? (IDENTIFICATION[place - 1] ?? 0) : 0;
  if (command === 0x35) return 0x02; // quad enabled
  return 0; // 05h: ready
}

export class Ssi {
  /** `selectControl()`: IO_QSPI's control word of the chip select; `onMapped(on)`: execute in place begins or ends. */
  constructor(selectControl, onMapped) {
    this.selectControl = selectControl;
    this.onMapped = onMapped;
    this.words = new Map();
    this.received = [];
    this.place = 0;
  }

  /** The chip select is held low by hand, for a command of several words. */
  get selected() {
    return ((this.selectControl() >>> OUTPUT_OVERRIDE) & 3) === DRIVE_LOW;
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
    if (offset === DATA) return this.send(value & 0xff);
    this.words.set(offset, value);
    if (offset !== ENABLE) return undefined;
    this.received = [];
    const mode = ((this.words.get(CONTROL0) ?? 0) >>> 8) & 3;
    return this.onMapped(value === 1 && mode === TMOD_EEPROM_READ);
  }

  /** Without the chip select held, a command ends when all its answers have been read. */
  send(byte) {
    if (!this.selected && this.received.length === 0) this.place = 0;
    if (this.place === 0) this.command = byte;
    this.received.push(answer(this.command, this.place++));
  }
}

export { QSPI_SELECT_CONTROL };
