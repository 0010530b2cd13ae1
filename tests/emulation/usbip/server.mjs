// SPDX-License-Identifier: Apache-2.0
// Exports an emulated board over USB/IP, so that a real USB stack (Linux' vhci-hcd) and libusb can use it:
//   node tests/emulation/usbip/server.mjs --uf2 FILE [--host 127.0.0.1] [--port 3240]
// Emulated time follows the wall clock as well as it can; it never runs ahead of it.

import fs from 'node:fs';
import net from 'node:net';
import { parseArgs } from 'node:util';
import { CYCLES_PER_MILLISECOND } from '../clock/constants.mjs';
import { Board } from '../board/board.mjs';
import { Connection } from './connection.mjs';

const SLICE = CYCLES_PER_MILLISECOND / 4;

/** Lets a board run with the wall clock; `stop()` ends it. An error of the emulation goes to `onFault`. */
export function runWithWallClock(board, onFault) {
  let stopped = false;
  const begin = { wall: performance.now(), cycle: board.cycle };
  const step = () => {
    if (stopped) return;
    const ahead = (board.cycle - begin.cycle) / CYCLES_PER_MILLISECOND - (performance.now() - begin.wall);
    if (ahead > 1) return void setTimeout(step, ahead);
    if (ahead < -100) Object.assign(begin, { wall: performance.now(), cycle: board.cycle }); // too slow: do not try to catch up
    try {
      board.run(SLICE);
    } catch (error) {
      onFault(error);
      return;
    }
    setImmediate(step);
  };
  step();
  return { stop: () => (stopped = true) };
}

export function serve(board) {
  return net.createServer((socket) => {
    socket.setNoDelay(true);
    new Connection(board.host, socket);
  });
}

function main() {
  const { values } = parseArgs({ options: { uf2: { type: 'string' }, host: { type: 'string', default: '127.0.0.1' }, port: { type: 'string', default: '3240' } } });
  if (!values.uf2) {
    console.error('usage: server.mjs --uf2 FILE [--host 127.0.0.1] [--port 3240]');
    process.exit(2);
  }
  const board = new Board(fs.readFileSync(values.uf2));
  board.connect();
  const fail = (error) => {
    console.error(`error: ${error.message}`);
    process.exit(1);
  };
  const server = serve(board).listen(Number(values.port), values.host, () => {
    console.log(`ready usbip:${values.host}:${server.address().port} ${board.host.device.productName}`);
    runWithWallClock(board, fail);
  });
  server.on('error', fail);
}

if (process.argv[1]?.endsWith('usbip/server.mjs')) main();
