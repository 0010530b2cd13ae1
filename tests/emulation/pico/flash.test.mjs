// SPDX-License-Identifier: Apache-2.0
// How the image uses flash: its second stage sets up quad reads, all code runs from RAM afterwards, and what it does while running costs
// no access to flash, whatever a miss would cost.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { records } from '../wire/client.mjs';
import { PicoRig, outputs, skip } from './rig.mjs';

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
