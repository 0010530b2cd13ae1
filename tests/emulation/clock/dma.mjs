// SPDX-License-Identifier: Apache-2.0
// DMA as rp2040js has it (DREQ, chains, rings, sizes), with four repairs: a transfer takes a cycle instead of no time (silicon's
// best rate is one a cycle), an address at which there is nothing is a bus error, CHAN_ABORT reads as done, and what is not modelled says so.

import { NANOSECONDS_PER_CYCLE } from './time.mjs';

const CHAN_ABORT = 0x444;
const SNIFF_CTRL = 0x434;
const SNIFF_DATA = 0x438;
const CTRL_OFFSETS = new Set([0x0c, 0x10, 0x20, 0x30]);

// CTRL (data sheet, 2.5.7).
const AHB_ERROR = 1 << 31;
const READ_ERROR = 1 << 30;
const WRITE_ERROR = 1 << 29;
const BUSY = 1 << 24;

const within = (address, begin, bytes) => address >= begin && address < begin + bytes;

/** Something answers at this address on the bus of the DMA, which does not reach SIO (data sheet, 2.1.2). */
function answers({ rp2040 }, address) {
  const memory = within(address, 0, 0x4000) || within(address, 0x10000000, 0x4000000) || within(address, 0x20000000, 0x42000);
  return memory || within(address, 0x50100000, 0x1000) || rp2040.peripherals[(address >>> 14) << 2] !== undefined;
}

/** A bus error: the channel halts, tells by its flags, and raises its interrupt, also if it is to be quiet (data sheet, 2.5.7, AHB_ERROR). */
function halt(dma, channel, error) {
  channel.ctrl = (channel.ctrl | error) & ~BUSY;
  dma.intRaw |= 1 << channel.index;
  dma.checkInterrupts();
}

function addBusErrors(chip, dma, channel) {
  const { transfer } = channel;
  channel.transferAlarm.callback = () => {
    if (!answers(chip, channel.readAddr >>> 0)) return halt(dma, channel, READ_ERROR);
    if (!answers(chip, channel.writeAddr >>> 0)) return halt(dma, channel, WRITE_ERROR);
    return transfer();
  };
  const read = channel.readUint32.bind(channel);
  channel.readUint32 = (offset) => {
    const value = read(offset);
    return CTRL_OFFSETS.has(offset) && value & (READ_ERROR | WRITE_ERROR) ? (value | AHB_ERROR) >>> 0 : value;
  };
}

/** `cycles`: how long a transfer takes; more than one is slower than silicon, to see what margin a program has. */
export function repairDma(chip, dma, cycles) {
  for (const channel of dma.channels) {
    addBusErrors(chip, dma, channel);
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
