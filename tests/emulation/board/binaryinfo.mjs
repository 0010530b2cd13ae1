// SPDX-License-Identifier: Apache-2.0
// What picotool reads from an image: the header within 256 bytes after boot2, and the entries that it leads to.

const FLASH = 0x10000000;
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
