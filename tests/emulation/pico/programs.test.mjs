// SPDX-License-Identifier: Apache-2.0
// Programs on the image: loops, waits and what becomes of them, marks, and one clock for outputs and inputs.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { delays, statistics } from '../edges/edges.mjs';
import { records } from '../wire/client.mjs';
import { expectedEdges, input, outputEdges, outputs, PicoRig, skip, VSYNC } from './rig.mjs';

const withVsync = (capture) => [...outputs, input(VSYNC.line, 'LINE_ROLE_VSYNC', { capture })];

function configured(lines = outputs) {
  const rig = new PicoRig();
  rig.configure(lines);
  return rig;
}

test('loops in loops come out word by word', { skip }, () => {
  const rig = configured();
  const inner = [[1, 1500], [3, 1600]];
  const words = [];
  for (let a = 0; a < 3; a++) {
    for (let b = 0; b < 4; b++) {
      for (let c = 0; c < 5; c++) words.push(...inner);
      words.push([0x80, 2000]);
    }
    words.push([0x900, 2500]);
  }
  const word = ([levels, ticks]) => records.word(levels, ticks);
  rig.start([
    records.loop(3, [...records.loop(4, [...records.loop(5, inner.map(word)), word([0x80, 2000])]), word([0x900, 2500])]),
    records.end(0x41),
  ]);
  const done = rig.finish();
  assert.equal(done.steps, words.length);
  assert.equal(done.duration, words.reduce((sum, each) => sum + each[1], 0));
  rig.client.run(1);
  assert.deepEqual(outputEdges(rig), expectedEdges(words, 0x41), 'and the last word stands');
});

test('a wait for a falling edge; a line that is low already must rise first', { skip }, () => {
  const rig = configured(withVsync(false));
  rig.start([records.word(1, 2000), records.wait(VSYNC.line, 'falling', 12_500_000), records.word(2, 2000), records.end()]);
  rig.client.run(5);
  assert.equal(rig.outputLevels, 1);
  rig.board.stimuli.drive(VSYNC.gpio, 1);
  rig.client.run(5);
  assert.equal(rig.outputLevels, 1);
  const fell = rig.board.cycle;
  rig.board.stimuli.drive(VSYNC.gpio, 0);
  assert.equal(rig.finish().end, 'RUN_END_COMPLETED');
  const { wait_latency: latency } = rig.client.must({ capabilities: {} }).capabilities;
  const answer = rig.edges(1).find((edge) => edge.level === 1).cycle - fell;
  assert.ok(Math.abs(answer - latency) <= 2, `${answer} cycles, said to be ${latency}`);
});

test('a wait that runs out goes on within a millisecond, or ends the run if it was told to', { skip }, () => {
  const rig = configured(withVsync(false));
  const { wait_latency: latency } = rig.client.must({ capabilities: {} }).capabilities;
  const timeOut = 1_250_000;
  rig.start([records.word(1, 2000), records.wait(VSYNC.line, 'rising', timeOut), records.word(3, 2000), records.end()]);
  assert.equal(rig.finish().end, 'RUN_END_COMPLETED');
  const [begin, resumed] = [rig.edges(0)[0].cycle, rig.edges(1)[0].cycle];
  const late = resumed - begin - 2000 - timeOut - latency;
  assert.ok(late >= 0 && late < 125_000, `${late} cycles`);
  rig.start([records.word(1, 2000), records.wait(VSYNC.line, 'rising', timeOut, true), records.word(3, 2000), records.end()]);
  const done = rig.finish();
  assert.deepEqual([done.end, done.arg], ['RUN_END_WAIT_TIMEOUT', 1]);
  rig.client.run(1);
  assert.equal(rig.outputLevels, 0);
  assert.equal(rig.edges(1).length, 0);
});

test('marks tell the tick at which the next word stands', { skip }, () => {
  const rig = configured();
  const rounds = 50;
  rig.start([records.loop(rounds, [records.mark(7), records.word(1, 5000), records.mark(8), records.word(0, 6000)]), records.end()]);
  rig.finish();
  const marks = rig.client.events.filter((event) => event.event === 'step_mark');
  assert.equal(marks.length, 2 * rounds);
  const edges = rig.edges(0);
  const offsets = marks.map((mark, i) => mark.tick - edges[i].cycle);
  assert.equal(statistics(offsets).jitter, 0);
  assert.deepEqual(marks.slice(0, 4).map((mark) => mark.id), [7, 8, 7, 8]);
});

test('an output wired to an input: its stamp and its mark agree to two ticks', { skip }, () => {
  const rig = configured(withVsync(true));
  rig.board.stimuli.wire(0, VSYNC.gpio);
  const rounds = 40;
  rig.start([records.loop(rounds, [records.mark(1), records.word(1, 40_003), records.mark(2), records.word(0, 50_006)]), records.end()]);
  rig.finish();
  rig.client.run(20);
  const of = (name) => rig.client.events.filter((event) => event.event === name);
  const [marks, stamps] = [of('step_mark'), of('edge')];
  assert.equal(stamps.length, marks.length);
  const errors = stamps.map((stamp, i) => stamp.tick - marks[i].tick);
  const { min, max } = statistics(errors);
  assert.ok(min >= -2 && max <= 2, `${min} to ${max} ticks`);
});

test('a run that needs nobody goes on without its cable', { skip }, () => {
  const rig = configured();
  rig.start([records.loop(200, [records.word(1, 60_000), records.word(0, 65_000)]), records.end()], { autonomous: true });
  rig.client.run(20);
  rig.board.host.plug(false);
  rig.board.runMilliseconds(300);
  assert.equal(rig.edges(0).length, 400);
  assert.equal(statistics(rig.edges(0).slice(1).map((edge, i) => edge.cycle - rig.edges(0)[i].cycle)).jitter, 5000);
});

// The image's edges: exact to the cycle, with USB traffic, from VSYNC, down to the shortest word.

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
