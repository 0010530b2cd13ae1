// SPDX-License-Identifier: Apache-2.0
// UF2 files as the RP2040's ROM takes them: 512-byte blocks of 256 bytes for one flash address each.

import fs from 'node:fs';
import path from 'node:path';

const MAGIC = [0x0a324655, 0x9e5d5157, 0x0ab16f30];
const FAMILY_RP2040 = 0xe48bff56;
const FAMILY_PRESENT = 0x2000;
const BLOCK = 512;
const PAYLOAD = 256;
const FLASH = 0x10000000;

function checkBlock(file, at, blocks) {
  const word = (offset) => file.readUInt32LE(at + offset);
  const bad = (what) => new Error(`UF2 block ${at / BLOCK}: ${what}`);
  if (word(0) !== MAGIC[0] || word(4) !== MAGIC[1] || word(508) !== MAGIC[2]) throw bad('wrong magic number');
  if (!(word(8) & FAMILY_PRESENT) || word(28) !== FAMILY_RP2040) throw bad('not for the RP2040 family (0xe48bff56)');
  if (word(16) !== PAYLOAD) throw bad(`${word(16)} bytes of payload; the ROM takes ${PAYLOAD}`);
  if (word(12) % PAYLOAD !== 0) throw bad('address is not a multiple of 256');
  if (word(20) !== at / BLOCK || word(24) !== blocks) throw bad(`says it is ${word(20)} of ${word(24)}, is ${at / BLOCK} of ${blocks}`);
  return word(12);
}

/** [{offset, data}] of a UF2 file, offsets from the begin of flash. Throws with the block and the reason. */
export function readUf2(file) {
  if (file.length === 0 || file.length % BLOCK !== 0) throw new Error(`UF2 file of ${file.length} bytes is not made of 512-byte blocks`);
  const pages = [];
  for (let at = 0; at < file.length; at += BLOCK) {
    const address = checkBlock(file, at, file.length / BLOCK);
    if (address < FLASH || address >= FLASH + (16 << 20)) throw new Error(`UF2 block ${at / BLOCK}: address 0x${address.toString(16)} is not in flash`);
    pages.push({ offset: address - FLASH, data: file.subarray(at + 32, at + 32 + PAYLOAD) });
  }
  return pages;
}

/** A UF2 file from a flash image that begins at 0x10000000. */
export function writeUf2(image) {
  const blocks = Math.ceil(image.length / PAYLOAD);
  const file = Buffer.alloc(blocks * BLOCK);
  for (let i = 0; i < blocks; i++) {
    const at = i * BLOCK;
    const head = [MAGIC[0], MAGIC[1], FAMILY_PRESENT, FLASH + i * PAYLOAD, PAYLOAD, i, blocks, FAMILY_RP2040];
    head.forEach((word, k) => file.writeUInt32LE(word, at + 4 * k));
    image.copy(file, at + 32, i * PAYLOAD, Math.min(image.length, (i + 1) * PAYLOAD));
    file.writeUInt32LE(MAGIC[2], at + 508);
  }
  return file;
}

// The second stage that the ROM loads: 252 bytes and their CRC-32 (polynomial 0x04c11db7, start all ones, nothing reflected,
// no final xor; RP2040 data sheet, 2.8.1.3.1).

const STAGE = 256;

export function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc = (crc ^ (byte << 24)) >>> 0;
    for (let bit = 0; bit < 8; bit++) crc = (crc & 0x80000000 ? (crc << 1) ^ 0x04c11db7 : crc << 1) >>> 0;
  }
  return crc;
}

export function boot2IsSound(flash) {
  const stage = Buffer.from(flash.buffer, flash.byteOffset, STAGE);
  return crc32(stage.subarray(0, STAGE - 4)) === stage.readUInt32LE(STAGE - 4);
}

/** Writes the CRC of an image's second stage into it. */
export function sealBoot2(image) {
  image.writeUInt32LE(crc32(image.subarray(0, STAGE - 4)), STAGE - 4);
  return image;
}

// What picotool reads from an image: the header within 256 bytes after boot2, and the entries that it leads to.

const BEGIN = 0x7188ebf2;
const END = 0xe71aa390;
const TEXT = 6;
const NUMBER = 5;
const PINS = 9;

/** Entries of a flash image: {id: value} and pins; null without a header. */
export function binaryInfo(flash) {
  const view = Buffer.from(flash.buffer, flash.byteOffset, flash.byteLength);
  const word = (address) => view.readUInt32LE(address - FLASH);
  const text = (address) => view.toString('latin1', address - FLASH, view.indexOf(0, address - FLASH));
  for (let at = FLASH + 0x100; at < FLASH + 0x200 - 16; at += 4) {
    if (word(at) !== BEGIN || word(at + 16) !== END) continue;
    const found = { copies: word(word(at + 12)), entries: new Map() };
    for (let entry = word(at + 4); entry < word(at + 8); entry += 4) {
      const place = word(entry);
      const type = word(place) & 0xffff;
      if (type === TEXT) found.entries.set(word(place + 4), text(word(place + 8)));
      if (type === NUMBER) found.entries.set(word(place + 4), word(place + 8));
      if (type === PINS) found.pins = { mask: word(place + 4), names: text(word(place + 8)).split('|') };
    }
    return found;
  }
  return null;
}

// The boot loader's drive as a folder: while the board is in its boot loader the folder has INFO_UF2.TXT, and a UF2 file that is
// copied into it is written to flash and started, as the ROM does it.

const INFO = 'UF2 Bootloader v3.0\nModel: Raspberry Pi RP2\nBoard-ID: RPI-RP2\n';
const INFO_NAME = 'INFO_UF2.TXT';
const SECTOR = 4096;

/** Writes a UF2 file into flash; the sectors that it touches are erased first. */
export function writeFlash(flash, uf2) {
  const pages = readUf2(uf2);
  for (const sector of new Set(pages.map(({ offset }) => offset - (offset % SECTOR)))) flash.fill(0xff, sector, sector + SECTOR);
  for (const { offset, data } of pages) flash.set(data, offset);
}

export class BootDrive {
  constructor(folder, session) {
    this.folder = folder;
    this.session = session;
    fs.mkdirSync(folder, { recursive: true });
    this.show(false);
  }

  show(on) {
    const file = path.join(this.folder, INFO_NAME);
    if (on && !fs.existsSync(file)) fs.writeFileSync(file, INFO);
    if (!on) fs.rmSync(file, { force: true });
  }

  /** Looks whether there is something to do; call it now and then. */
  poll() {
    const waiting = this.session.board.bootloader !== null;
    this.show(waiting);
    if (!waiting) return;
    for (const name of fs.readdirSync(this.folder)) if (name.toLowerCase().endsWith('.uf2')) this.take(path.join(this.folder, name));
  }

  take(file) {
    const bytes = fs.readFileSync(file);
    try {
      readUf2(bytes);
    } catch {
      return; // not all there yet
    }
    fs.rmSync(file);
    this.show(false);
    this.session.flash(bytes);
  }
}
