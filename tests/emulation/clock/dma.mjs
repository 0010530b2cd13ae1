// SPDX-License-Identifier: Apache-2.0
// DMA as rp2040js has it (DREQ, chains, rings, sizes), with three repairs: a transfer takes a cycle instead of no time (silicon's
// best rate is one a cycle), CHAN_ABORT reads as done, and what is not modelled says so.

import { NANOSECONDS_PER_CYCLE } from './constants.mjs';

const CHAN_ABORT = 0x444;
const SNIFF_CTRL = 0x434;
const SNIFF_DATA = 0x438;

/** `cycles`: how long a transfer takes; more than one is slower than silicon, to see what margin a program has. */
export function repairDma(chip, dma, cycles) {
  for (const channel of dma.channels) {
    const { transferAlarm } = channel;
    const schedule = transferAlarm.schedule.bind(transferAlarm);
    transferAlarm.schedule = (nanos) => schedule(nanos || cycles * NANOSECONDS_PER_CYCLE);
  }
  const read = dma.readUint32.bind(dma);
  dma.readUint32 = (offset) => {
    if (offset === CHAN_ABORT) return 0;
    if (offset === SNIFF_CTRL || offset === SNIFF_DATA) chip.fault('the DMA sniffer is not modelled');
    return read(offset);
  };
}

/** Back to reset values. */
export function resetDma(dma) {
  for (const channel of dma.channels) {
    channel.abort();
    Object.assign(channel, { ctrl: 0, readAddr: 0, writeAddr: 0, transCount: 0, transCountReload: 0 });
    channel.reset();
  }
  Object.assign(dma, { intRaw: 0, intEnable0: 0, intForce0: 0, intEnable1: 0, intForce1: 0 });
  Object.assign(dma, { timer0: 0, timer1: 0, timer2: 0, timer3: 0 });
  dma.checkInterrupts();
}
