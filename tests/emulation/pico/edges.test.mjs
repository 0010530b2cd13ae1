// SPDX-License-Identifier: Apache-2.0
// The image's edges: exact to the cycle, with USB traffic, from VSYNC, down to the shortest word.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { delays, statistics } from '../edges/statistics.mjs';
import { records } from '../wire/client.mjs';
import { PicoRig, VSYNC, expectedEdges, input, outputEdges, outputs, skip } from './rig.mjs';

const ALL = 0xfff;

test('100,000 edges on twelve outputs are exact while the host asks without pause', { skip }, () => {
  const rig = new PicoRig();
  rig.configure();
  const round = [[ALL, 900], [0x555, 901], [0xaaa, 953], [0, 1007]];
  const rounds = 3200;
  rig.start([records.loop(rounds, round.map(([levels, ticks]) => records.word(levels, ticks))), records.end()]);
  let asked = 0;
  while (!rig.client.events.some((event) => event.event === 'run_done')) {
    rig.client.ask({ get_status: {} });
    asked++;
  }
  const done = rig.client.events.find((event) => event.event === 'run_done');
  assert.equal(done.end, 'RUN_END_COMPLETED');
  assert.ok(asked > 100, `${asked} requests during the run`);
  const words = Array.from({ length: rounds }, () => round).flat();
  const expected = expectedEdges(words);
  assert.ok(expected.length > 100_000);
  assert.deepEqual(outputEdges(rig), expected);
  assert.deepEqual(rig.board.host.errors, []);
});

test('a burst of words of the shortest length that the board allows', { skip }, () => {
  const rig = new PicoRig();
  rig.configure();
  const { min_dwell: shortest } = rig.client.must({ capabilities: {} }).capabilities;
  assert.ok(shortest * 8 <= 64, `${shortest * 8} ns`);
  const words = Array.from({ length: 300 }, (_, i) => [(i * 0x155 + 1) & ALL, shortest + (i % 3)]);
  rig.start([...words.map(([levels, ticks]) => records.word(levels, ticks)), records.end()]);
  assert.equal(rig.finish().end, 'RUN_END_COMPLETED');
  assert.deepEqual(outputEdges(rig), expectedEdges(words));
});

test('the camera follows VSYNC by the same number of cycles in 1000 frames', { skip }, () => {
  const rig = new PicoRig();
  rig.configure([...outputs, input(VSYNC.line, 'LINE_ROLE_VSYNC')]);
  const { wait_latency: latency } = rig.client.must({ capabilities: {} }).capabilities;
  rig.board.stimuli.pulse(VSYNC.gpio, 1_000_333, 20_000);
  rig.start([records.loop(1000, [records.wait(VSYNC.line, 'rising', 500_000), records.word(2, 5000), records.word(0, 5000)]), records.end()]);
  assert.equal(rig.finish().end, 'RUN_END_COMPLETED');
  const { count, min, jitter } = statistics(delays(rig.edges(VSYNC.gpio), rig.edges(1)));
  assert.equal(count, 1000);
  assert.ok(jitter <= 1, `${jitter} cycles`);
  // wait_latency counts from the tick of the edge as the board stamps it, which has a resolution of two ticks.
  assert.ok(Math.abs(min - latency) <= 2, `${min} cycles, said to be ${latency}`);
});

test('the same edges with slow DMA', { skip }, () => {
  const edges = [1, 6].map((dmaCycles) => {
    const rig = new PicoRig({ dmaCycles });
    rig.configure();
    rig.start([records.loop(40, [records.word(1, 700), records.word(2, 800), records.word(3, 900)]), records.word(7, 50), records.end()]);
    assert.equal(rig.finish().end, 'RUN_END_COMPLETED');
    return outputEdges(rig);
  });
  assert.deepEqual(edges[1], edges[0]);
});

test('fast-forward changes nothing: every pin and every event, to the cycle', { skip }, () => {
  const [fast, slow] = [true, false].map((fastForward) => {
    const rig = new PicoRig({ fastForward });
    rig.configure([...outputs, input(VSYNC.line, 'LINE_ROLE_VSYNC', { capture: true })]);
    rig.board.stimuli.pulse(VSYNC.gpio, 1_000_333, 20_000);
    rig.start([records.loop(15, [records.wait(VSYNC.line, 'rising', 500_000), records.mark(1), records.word(2, 5000), records.word(0, 5000)]), records.end()]);
    rig.finish();
    return { hash: rig.board.recorder.hash(), events: rig.client.events, arrived: rig.client.arrived, instructions: rig.board.chip.scheduler.instructions };
  });
  assert.deepEqual(fast, slow);
  assert.ok(fast.events.length > 40);
});
