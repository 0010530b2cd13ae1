// SPDX-License-Identifier: Apache-2.0
// Why the board says that it started, and what a stopped crystal does.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import { test } from 'node:test';
import { writeFlash } from '../board/image.mjs';
import { CYCLES_PER_MICROSECOND, CYCLES_PER_MILLISECOND } from '../clock/time.mjs';
import { records } from '../wire/client.mjs';
import { crc32c } from '../wire/frames.mjs';
import { IMAGE, outputs, PicoRig, skip } from './rig.mjs';

const SAFE_WITHIN_MS = 300;
const ALIVE = 12;

function back(rig) {
  rig.board.run(500 * CYCLES_PER_MILLISECOND, () => rig.board.host.device !== null);
  rig.connect();
  return rig.status();
}

test('a board that was flashed through its drive does not report a watchdog', { skip }, () => {
  const rig = new PicoRig();
  rig.client.must({ reboot: { token: crc32c(rig.hello.unique_id), bootloader: true } });
  rig.board.run(200 * CYCLES_PER_MILLISECOND, () => rig.board.bootloader !== null);
  writeFlash(rig.board.flash.bytes, fs.readFileSync(IMAGE));
  rig.board.restartFromBootloader();
  const status = back(rig);
  assert.equal(status.reset_cause, 'RESET_CAUSE_REQUEST');
  assert.equal(status.reset_fault, undefined);
});

test('nor does a board that was flashed with its button, and never ran before', { skip }, () => {
  const rig = new PicoRig();
  rig.board.chip.watchdog.scratch.fill(0); // power-up
  rig.board.enterBootloader(0, 0, 'BOOTSEL');
  rig.board.restartFromBootloader();
  const status = back(rig);
  assert.equal(status.reset_cause, 'RESET_CAUSE_REQUEST');
  assert.equal(status.reset_fault, undefined);
});

const WATCHDOG_US = 400_000;

test('a watchdog that is starved on purpose resets the chip, in its time, with outputs and alive at rest', { skip }, () => {
  const rig = new PicoRig();
  rig.configure(outputs);
  rig.client.must({ manual_set: { mask: 1, levels: 1 } });
  const starve = { reboot: { token: crc32c(rig.hello.unique_id), starve_watchdog: true } };
  rig.client.must(starve);
  const begin = rig.board.cycle;
  assert.equal(rig.outputLevels, 0);
  assert.equal(rig.client.ask({ manual_set: { mask: 1, levels: 1 } }).code, 'CODE_BAD_STATE');
  rig.client.run(2);
  rig.board.recorder.clear();
  // It goes on answering, without a feed.
  rig.client.run(WATCHDOG_US / 1000 - 20);
  assert.equal(rig.status().reset_cause, 'RESET_CAUSE_POWER');
  rig.board.run(50 * CYCLES_PER_MILLISECOND, () => rig.board.chip.resetCount > 0);
  assert.equal(rig.board.chip.resetCount, 1);
  const after = (rig.board.cycle - begin) / CYCLES_PER_MICROSECOND;
  assert.ok(Math.abs(after - WATCHDOG_US) < 5000, `${after} us`);
  assert.equal(rig.edges(ALIVE).length, 0, 'alive stands still while the watchdog starves');
  const { reset_cause: cause, reset_fault: fault, state } = back(rig);
  assert.deepEqual([cause, fault.code, state], ['RESET_CAUSE_WATCHDOG', 'FAULT_WATCHDOG', 'STATE_SAFE']);
  assert.equal(rig.client.must({ get_diagnostics: {} }).diagnostics.crash, undefined);
});

test('a crystal that stops: outputs and alive are let go, and the board does not come back', { skip }, () => {
  for (const offset of [0, 17, 61, 133]) {
    const rig = new PicoRig();
    rig.configure(outputs);
    rig.start([records.loop(1_000_000, [records.word(0xfff, 250_000), records.word(0xffe, 250_000)]), records.end()]);
    rig.client.run(5 + offset);
    assert.ok(rig.outputLevels >= 0xffe);
    const begin = rig.board.cycle;
    rig.board.chip.stopCrystal();
    rig.board.run(SAFE_WITHIN_MS * CYCLES_PER_MILLISECOND, () => rig.outputLevels === 0);
    assert.equal(rig.outputLevels, 0);
    const taken = (rig.lastOutputEdge - begin) / CYCLES_PER_MILLISECOND;
    assert.ok(taken <= SAFE_WITHIN_MS, `${taken} ms`);
    rig.board.runMilliseconds(1);
    rig.board.recorder.clear();
    rig.board.runMilliseconds(50);
    assert.equal(rig.edges(ALIVE).length, 0);
    assert.equal(rig.outputLevels, 0);
  }
});

/** A line that is safe at high, with its safe level stored and a pull-up outside: nothing drives it low. */
function activeLow() {
  const rig = new PicoRig();
  rig.configure(outputs.map((line) => (line.line === 3 ? { ...line, safe_level: true } : line)));
  rig.client.must({ store_config: { label: 'active low' } });
  rig.board.stimuli.drive(3, 1);
  rig.board.chip.pads.contention.clear();
  return rig;
}

const never = (rig, what) => assert.deepEqual([...rig.board.chip.pads.contention.keys()].filter((gpio) => gpio === 3), [], what);

test('a line that is safe at high is never driven low by a restart, whatever its cause', { skip }, () => {
  const rig = activeLow();
  rig.client.must({ reboot: { token: crc32c(rig.hello.unique_id) } });
  rig.board.run(200 * CYCLES_PER_MILLISECOND, () => rig.board.chip.resetCount === 1);
  assert.equal(back(rig).reset_cause, 'RESET_CAUSE_REQUEST');
  never(rig, 'request');
  const { core, rp2040 } = rig.board.chip;
  rp2040.writeUint16(0x20041000, 0xe7fe); // b .
  Object.assign(core, { PC: 0x20041000, PM: true, waiting: false });
  rig.board.run(1000 * CYCLES_PER_MILLISECOND, () => rig.board.chip.resetCount === 2);
  assert.equal(back(rig).reset_cause, 'RESET_CAUSE_WATCHDOG');
  never(rig, 'watchdog');
  const again = rig.powerCycle();
  assert.equal((again.outputLevels >>> 3) & 1, 1);
  assert.equal(again.status().reset_cause, 'RESET_CAUSE_POWER');
  never(again, 'power');
});

// A program that crashes or hangs: pins let go, a restart, and a record of the place.

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

// How the image uses flash: its second stage sets up quad reads, all code runs from RAM afterwards, and what it does while running costs
// no access to flash, whatever a miss would cost.

const QUAD_WORD = 48;
const SERIAL_WORD = 264;
const FAST_CLOCK_PAD = 0x21; // PADS_QSPI SCLK: fast slew, 8 mA
const SCLK = 0x04;

const clockPad = (rig) => rig.board.chip.rp2040.peripherals[0x40020].readUint32(SCLK);

test('the second stage sets up quad reads that continue without a command', { skip }, () => {
  const rig = new PicoRig();
  assert.equal(rig.board.flash.ssi.missCycles, QUAD_WORD);
  assert.equal(clockPad(rig), FAST_CLOCK_PAD);
});

test('it sets the QE bit of a fresh flash chip, once', { skip }, () => {
  const rig = new PicoRig({ quadEnabled: false });
  assert.equal(rig.board.flash.flashChip.status2, 2);
  assert.equal(rig.board.flash.ssi.missCycles, QUAD_WORD);
  rig.powerCycle();
});

test('with a flash chip that takes no QE bit it falls back to serial reads', { skip }, () => {
  const rig = new PicoRig({ quadEnabled: 'never' });
  assert.equal(rig.board.flash.ssi.missCycles, SERIAL_WORD);
  assert.equal(rig.hello.board, 'pico');
});

test('after a store to flash, the fast mode and its pads are back, and the settings can be read', { skip }, () => {
  const rig = new PicoRig();
  rig.configure();
  rig.client.must({ store_config: { label: 'quad' } });
  assert.equal(rig.board.flash.programmed > 0, true);
  assert.equal(rig.board.flash.ssi.missCycles, QUAD_WORD);
  assert.equal(clockPad(rig), FAST_CLOCK_PAD);
  assert.equal(rig.powerCycle().client.must({ capabilities: {} }).capabilities.label, 'quad');
});

test('requests, a run and an abort read nothing from flash', { skip }, () => {
  const rig = new PicoRig();
  const { xip } = rig.board.chip;
  xip.flush();
  const before = xip.accesses;
  rig.configure();
  rig.start([records.loop(2000, [records.word(1, 700), records.word(2, 800)]), records.end()]);
  for (let i = 0; i < 20; i++) rig.status();
  rig.client.ask({ abort: {} }, { urgent: true });
  rig.configure(outputs.slice(0, 3));
  assert.equal(xip.accesses - before, 0);
});

test('the same edges and events at the same cycles, whatever a miss costs', { skip }, () => {
  const [cheap, dear] = [0, SERIAL_WORD].map((missCycles) => {
    const rig = new PicoRig({ missCycles });
    rig.configure();
    rig.start([records.loop(500, [records.mark(1), records.word(1, 5000), records.word(2, 4800)]), records.end()]);
    assert.equal(rig.finish().end, 'RUN_END_COMPLETED');
    const begin = rig.edges(0)[0].cycle;
    return rig.board.recorder.edges.filter((edge) => edge.gpio < 12).map(({ cycle, gpio, level }) => [cycle - begin, gpio, level]);
  });
  assert.deepEqual(dear, cheap);
});
