// SPDX-License-Identifier: Apache-2.0
// Exports an emulated board over USB/IP, so that a real USB stack (Linux' vhci-hcd) and libusb can use it:
//   node tests/emulation/usbip/server.mjs --uf2 FILE [--host 127.0.0.1] [--port 3240] [--jumper FROM:TO]
// --jumper is a wire between two pins of the board, by the numbers of their GPIOs.
// Emulated time follows the wall clock as well as it can; it never runs ahead of it.

import fs from 'node:fs';
import net from 'node:net';
import { parseArgs } from 'node:util';
import { Board } from '../board/board.mjs';
import { CYCLES_PER_MILLISECOND } from '../clock/time.mjs';
import { Connection } from './connection.mjs';

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

// Lets an emulated board's time follow the wall clock as a real board's does: never ahead, and level with it whenever the
// host says something. So what the host reads of the board's clock lies between its question and the answer.

const SLICE = CYCLES_PER_MILLISECOND / 4; // between two looks at the sockets
const TOO_SLOW = 100 * CYCLES_PER_MILLISECOND; // so far behind the board is not made to catch up: its time has a gap then

export class WallClock {
  /** onFault: gets an error of the emulation, which ends here. */
  constructor(board, onFault) {
    this.board = board;
    this.onFault = onFault;
    this.level();
    this.step();
  }

  level() {
    this.begin = { wall: performance.now(), cycle: this.board.cycle };
  }

  /** Cycles that the board lacks. */
  behind() {
    return Math.floor((performance.now() - this.begin.wall) * CYCLES_PER_MILLISECOND) - (this.board.cycle - this.begin.cycle);
  }

  /** Runs the board for at most `most` of what it lacks. */
  run(most) {
    if (this.stopped) return;
    const cycles = this.behind();
    if (cycles > TOO_SLOW) this.level();
    else if (cycles > 0) this.board.run(Math.min(cycles, most));
  }

  guarded(work) {
    try {
      work();
    } catch (error) {
      this.stop();
      this.onFault(error);
    }
  }

  step() {
    this.guarded(() => this.run(SLICE));
    if (this.stopped) return;
    if (this.behind() > 0) setImmediate(() => this.step());
    else setTimeout(() => this.step(), 1);
  }

  /** Before something that the host has sent reaches the board. */
  catchUp() {
    this.guarded(() => this.run(TOO_SLOW));
  }

  stop() {
    this.stopped = true;
  }
}

if (process.argv[1]?.endsWith('usbip/server.mjs')) main();
