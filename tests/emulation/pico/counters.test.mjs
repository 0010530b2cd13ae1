// SPDX-License-Identifier: Apache-2.0
// What the board counts of its own hardware's errors: words that do not fit the queue, and errors of DMA on the bus.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { records, schema } from '../wire/client.mjs';
import { PicoRig, expectedEdges, outputEdges, outputs, skip } from './rig.mjs';

const TXF0 = 0x50200010;
const DMA = 0x50000000;
const READ_ADDR = 0;
const WRITE_ADDR = 4;
const DATA = 0; // the channels of the edge engine (board_pins.hpp)
const CONTROL = 1;
const NOTHING = 0x60000000; // an address without anything

const WORDS = Array.from({ length: 3000 }, (_, i) => [((i + 1) * 37) & 0xfff, 2000 + (i % 7)]);
const program = [...WORDS.map(([levels, ticks]) => records.word(levels, ticks)), records.end()];

function running() {
  const rig = new PicoRig();
  rig.configure(outputs);
  rig.start(program);
  rig.client.run(2);
  return rig;
}

const counters = (rig) => {
  const { queue_overflows: overflows, dma_errors: errors } = rig.client.must({ get_diagnostics: {} }).diagnostics;
  return { overflows, errors };
};

test('a word that is written to a full queue is lost, counted, and no output shows it', { skip }, () => {
  const rig = running();
  assert.deepEqual(counters(rig), { overflows: 0, errors: 0 });
  for (let i = 1; i <= 3; i++) {
    rig.board.chip.rp2040.writeUint32(TXF0, 0xffffffff);
    rig.client.run(1.5); // a round of the main loop looks once
    assert.deepEqual(counters(rig), { overflows: i, errors: 0 });
  }
  assert.equal(rig.finish().end, 'RUN_END_COMPLETED');
  assert.deepEqual(outputEdges(rig), expectedEdges(WORDS));
});

for (const [name, channel, register] of [['words', DATA, WRITE_ADDR], ['grants', CONTROL, READ_ADDR]]) {
  test(`an error of DMA on its way with ${name}: counted, safe levels at the end of the queue, and nothing that was not planned`, { skip }, () => {
    const rig = running();
    rig.board.chip.rp2040.writeUint32(DMA + 0x40 * channel + register, NOTHING);
    rig.client.run(200);
    const { state, fault } = rig.status();
    assert.deepEqual([state, fault.code], ['STATE_FAULT', 'FAULT_UNDERRUN']);
    assert.equal(rig.outputLevels, 0);
    assert.deepEqual(counters(rig), { overflows: 0, errors: 1 });
    const [seen, planned] = [outputEdges(rig), expectedEdges(WORDS)];
    const last = seen.at(-1)[0]; // the fall to the safe levels, at the time of a word
    const before = seen.filter(([cycle]) => cycle < last);
    assert.deepEqual(before, planned.slice(0, before.length));
    assert.ok(planned.some(([cycle]) => cycle === last), 'in the cycle of the next word');

    rig.client.must({ clear_fault: { code: schema.enums.FaultCode[fault.code] } });
    rig.configure(outputs);
    rig.start(program);
    assert.equal(rig.finish().end, 'RUN_END_COMPLETED');
    assert.deepEqual(outputEdges(rig), planned);
    assert.deepEqual(counters(rig), { overflows: 0, errors: 1 });
  });
}
