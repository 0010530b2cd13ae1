// SPDX-License-Identifier: Apache-2.0
// A program that crashes or hangs: pins let go, a restart, and a record of the place.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CYCLES_PER_MICROSECOND, CYCLES_PER_MILLISECOND } from '../clock/constants.mjs';
import { records } from '../wire/client.mjs';
import { PicoRig, outputs, skip } from './rig.mjs';

const PLACE = 0x20041000; // memory that the image does not use
const STACK_BOTTOM = 0x20040000;
const GUARD = 256;
const SYSTICK = 15;
const HARD_FAULT = 3;

function running(options) {
  const rig = new PicoRig({ deliverFaults: true, ...options });
  rig.configure(outputs);
  rig.start([records.word(0xff, 125_000_000), records.end()]);
  rig.client.run(2);
  return rig;
}

/** Lets the main program go on at code of our own. */
function jump(rig, opcodes, registers = {}) {
  const { core, rp2040 } = rig.board.chip;
  rig.board.run(200_000, () => core.IPSR === 0 && !core.waiting);
  opcodes.forEach((opcode, i) => rp2040.writeUint16(PLACE + 2 * i, opcode));
  Object.assign(core, { PC: PLACE, waiting: false, PM: false });
  for (const [index, value] of Object.entries(registers)) core.registers[index] = value;
  return rig.board.cycle;
}

function afterwards(rig) {
  rig.board.run(1000 * CYCLES_PER_MILLISECOND, () => rig.board.chip.resetCount > 0);
  rig.board.run(500 * CYCLES_PER_MILLISECOND, () => rig.board.host.device !== null);
  rig.connect();
  return { status: rig.status(), diagnostics: rig.client.must({ get_diagnostics: {} }).diagnostics };
}

test('a hard fault: pins let go at once, and the registers are kept', { skip }, () => {
  const rig = running();
  const begin = jump(rig, [0x6800], { 0: 0x11 /* ldr r0, [r0]: not aligned */, 1: 0x22, 12: 0xcc, 14: 0x20001235 });
  rig.board.run(100 * CYCLES_PER_MICROSECOND);
  assert.equal(rig.outputLevels, 0);
  assert.ok(rig.lastOutputEdge - begin < 10 * CYCLES_PER_MICROSECOND, `${rig.lastOutputEdge - begin} cycles`);
  const { status, diagnostics } = afterwards(rig);
  const { crash } = diagnostics;
  assert.deepEqual([crash.exception, crash.pc, crash.lr, crash.r0, crash.r1, crash.r12], [HARD_FAULT, PLACE, 0x20001235, 0x11, 0x22, 0xcc]);
  assert.equal(crash.psr & 0x3f, 0, 'it was the main program');
  assert.ok(crash.sp > STACK_BOTTOM && crash.sp <= STACK_BOTTOM + 2304);
  assert.deepEqual([status.reset_cause, status.reset_fault.code, Number(status.reset_fault.arg)], ['RESET_CAUSE_WATCHDOG', 'FAULT_INTERNAL', PLACE]);
});

test('a main loop that hangs: the watchdog, and the place', { skip }, () => {
  const rig = running();
  jump(rig, [0xe7fe]); // b .
  const { status, diagnostics } = afterwards(rig);
  assert.deepEqual([diagnostics.crash.exception, diagnostics.crash.pc], [SYSTICK, PLACE]);
  assert.deepEqual([status.reset_cause, status.reset_fault.code], ['RESET_CAUSE_WATCHDOG', 'FAULT_WATCHDOG']);
});

test('a fault that came first is kept over the reset', { skip }, () => {
  const rig = new PicoRig({ deliverFaults: true });
  rig.configure(outputs);
  rig.start([records.loop(1_000_000, [records.word(1, 5000), records.word(3, 5000)]), records.end()]);
  rig.client.run(5);
  rig.board.chip.rp2040.writeUint32(0x50000444, 0xfff); // no DMA: an underrun
  rig.client.run(30);
  jump(rig, [0x6800], { 0: 0x11 });
  assert.equal(afterwards(rig).status.reset_fault.code, 'FAULT_UNDERRUN');
});

test('a stack that grows beyond its room runs into its guard', { skip }, () => {
  const rig = running();
  jump(rig, [0xb4ff, 0xe7fd]); // push {r0-r7}, for ever
  const { core } = rig.board.chip;
  rig.board.run(200 * CYCLES_PER_MICROSECOND, () => rig.outputLevels === 0 || rig.board.chip.lockedUp);
  assert.match(rig.board.chip.lastFault, /which the MPU guards/);
  assert.ok(core.registers[13] >= STACK_BOTTOM + GUARD - 64);
  afterwards(rig);
  assert.equal(rig.outputLevels, 0);
});

test('a power cycle forgets the crash; a sound board has none, and stack to spare', { skip }, () => {
  const rig = running();
  const { crash, stack_free: free } = rig.client.must({ get_diagnostics: {} }).diagnostics;
  assert.equal(crash, undefined);
  assert.ok(free >= 512, `${free} bytes`);
  const told = rig.client.must({ get_diagnostics: {} }).diagnostics;
  assert.deepEqual([told.flash_reads, told.queue_overflows, told.dma_errors, told.chip_revision], [0, 0, 0, 2]);
});
