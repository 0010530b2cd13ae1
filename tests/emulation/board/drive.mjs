// SPDX-License-Identifier: Apache-2.0
// The boot loader's drive as a folder: while the board is in its boot loader the folder has INFO_UF2.TXT, and a UF2 file that is
// copied into it is written to flash and started, as the ROM does it.

import fs from 'node:fs';
import path from 'node:path';
import { readUf2 } from './uf2.mjs';

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
