// SPDX-License-Identifier: Apache-2.0
// Lets an emulated board's time follow the wall clock as a real board's does: never ahead, and level with it whenever the
// host says something. So what the host reads of the board's clock lies between its question and the answer.

import { CYCLES_PER_MILLISECOND } from '../clock/constants.mjs';

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
