// SPDX-License-Identifier: Apache-2.0
// Which stores and loads are possible. rp2040js lets a program write to flash and ROM, and answers for blocks that are held in reset.

import { RESET_BITS } from './resets.mjs';

const RAM = 0x20000000;
const RAM_END = 0x20042000;
const FLASH = 0x10000000;
const FLASH_END = 0x14000000;
const ROM_END = 0x4000;
const SIO_FIFO = new Set([0x50, 0x54, 0x58]);

const hex = (value) => `0x${(value >>> 0).toString(16)}`;

export function guardMemory(chip, rp2040) {
  guardStores(chip, rp2040);
  guardBlocks(chip, rp2040);
  guardSecondCore(chip, rp2040.sio);
}

function guardStores(chip, rp2040) {
  const { sramView } = rp2040;
  const store = rp2040.writeUint32.bind(rp2040);
  rp2040.writeUint32 = (address, value) => {
    address >>>= 0;
    if (address >= RAM && address + 3 < RAM_END) return sramView.setUint32(address - RAM, value, true);
    if (address >= FLASH && address < FLASH_END) return chip.fault(`a store to flash at ${hex(address)}; only the ROM functions write there`);
    if (address < ROM_END) return chip.fault(`a store to ROM at ${hex(address)}`);
    return store(address, value);
  };
}

function guardBlocks(chip, rp2040) {
  rp2040.findPeripheral = (address) => {
    const key = (address >>> 14) << 2;
    const block = rp2040.peripherals[key];
    if (block === undefined) return undefined;
    const bit = RESET_BITS[key];
    if (bit !== undefined && (chip.resets.held >>> bit) & 1) {
      chip.fault(`${hex(address)} is in a block that RESETS holds in reset (bit ${bit})`);
    }
    return block;
  };
}

function guardSecondCore(chip, sio) {
  for (const name of ['readUint32', 'writeUint32']) {
    const access = sio[name].bind(sio);
    sio[name] = (offset, value) => {
      if (SIO_FIFO.has(offset)) chip.fault('the second core and its mailbox are not modelled');
      return access(offset, value);
    };
  }
}
