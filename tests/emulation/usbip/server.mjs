// SPDX-License-Identifier: Apache-2.0
// Exports an emulated board over USB/IP, so that a real USB stack (Linux' vhci-hcd) and libusb can use it:
//   node tests/emulation/usbip/server.mjs --uf2 FILE [--host 127.0.0.1] [--port 3240] [--jumper FROM:TO]
// --jumper is a wire between two pins of the board, by the numbers of their GPIOs.
// Emulated time follows the wall clock as well as it can; it never runs ahead of it.

import fs from 'node:fs';
import net from 'node:net';
import { parseArgs } from 'node:util';
import { Board } from '../board/board.mjs';
import { Connection } from './connection.mjs';
import { WallClock } from './wall_clock.mjs';

export function serve(board, clock) {
  return net.createServer((socket) => {
    socket.setNoDelay(true);
    socket.on('data', () => clock.catchUp()); // before the connection's own listener
    new Connection(board.host, socket);
  });
}

const OPTIONS = {
  uf2: { type: 'string' },
  host: { type: 'string', default: '127.0.0.1' },
  port: { type: 'string', default: '3240' },
  jumper: { type: 'string' },
};

function main() {
  const { values } = parseArgs({ options: OPTIONS });
  const wire = values.jumper?.match(/^(\d+):(\d+)$/);
  if (!values.uf2 || (values.jumper && !wire)) {
    console.error('usage: server.mjs --uf2 FILE [--host 127.0.0.1] [--port 3240] [--jumper FROM:TO]');
    process.exit(2);
  }
  const board = new Board(fs.readFileSync(values.uf2));
  if (wire) board.stimuli.wire(Number(wire[1]), Number(wire[2]));
  board.connect();
  const fail = (error) => {
    console.error(`error: ${error.message}`);
    process.exit(1);
  };
  const clock = new WallClock(board, fail);
  const server = serve(board, clock).listen(Number(values.port), values.host, () => {
    console.log(`ready usbip:${values.host}:${server.address().port} ${board.host.device.productName}`);
  });
  server.on('error', fail);
}

if (process.argv[1]?.endsWith('usbip/server.mjs')) main();
