// SPDX-License-Identifier: Apache-2.0
// Why the board says that it started, and what a stopped crystal does.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import { test } from 'node:test';
import { writeFlash } from '../board/drive.mjs';
import { CYCLES_PER_MICROSECOND, CYCLES_PER_MILLISECOND } from '../clock/constants.mjs';
import { crc32c } from '../wire/frames.mjs';
import { records } from '../wire/client.mjs';
import { IMAGE, PicoRig, outputs, skip } from './rig.mjs';

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
