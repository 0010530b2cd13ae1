// SPDX-License-Identifier: Apache-2.0
// Boards with the test images, built on first use (arm-none-eabi-g++ and make); a lock keeps test files that run side by side apart.

import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import { fileURLToPath } from 'node:url';
import { Board } from '../board/board.mjs';

const FOLDER = fileURLToPath(new URL('../images/', import.meta.url));
const RESULTS = 0x20000000;

export function imageFile(name) {
  fs.mkdirSync(`${FOLDER}build`, { recursive: true });
  execFileSync('flock', [`${FOLDER}build/lock`, 'make', '-s', '-C', FOLDER, `build/${name}.uf2`], { stdio: ['ignore', 'inherit', 'inherit'] });
  return `${FOLDER}build/${name}.uf2`;
}

export const imageBytes = (name) => fs.readFileSync(imageFile(name));

/** The images run from flash and measure other things than its cache: there, a miss costs nothing unless a test says so. */
export const boardWith = (name, options) => new Board(imageBytes(name), { missCycles: 0, ...options });

/** What the image has told so far. */
export function results(board) {
  const word = (index) => board.chip.rp2040.readUint32(RESULTS + 4 * index) >>> 0;
  return Array.from({ length: word(0) }, (_, i) => word(1 + i));
}
