// SPDX-License-Identifier: Apache-2.0

import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { test } from 'node:test';
import { Ledger } from './campaign.mjs';

const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'symrig-ledger-'));
test.after(() => fs.rmSync(folder, { recursive: true }));
const write = (name, text) => {
  fs.writeFileSync(path.join(folder, name), text);
  return path.join(folder, name);
};
const items = [0, 1, 2, 3, 4, 5, 6];

test('a later run goes on behind an earlier one, and its results add up', () => {
  const image = write('image', 'one');
  const LEDGER = path.join(folder, 'adds-up');
  const first = new Ledger('words', image, { LEDGER });
  for (const item of first.left(items)) {
    if (item === 3) break;
    first.note(item, 10 * item);
  }
  const second = new Ledger('words', image, { LEDGER });
  assert.deepEqual([...second.left(items)], [3, 4, 5, 6]);
  second.note(3, 30);
  assert.deepEqual([...new Ledger('words', image, { LEDGER }).results.values()], [0, 10, 20, 30]);
});

test('shards share the work without overlap', () => {
  const image = write('image', 'one');
  const parts = ['0/3', '1/3', '2/3'].flatMap((SHARD) => [...new Ledger('words', image, { SHARD }).left(items)]);
  assert.deepEqual(parts.sort(), items);
  assert.throws(() => new Ledger('words', image, { SHARD: '3/3' }), /SYMRIG_SHARD/);
});

test('another image and another campaign begin anew', () => {
  const LEDGER = path.join(folder, 'another');
  const one = new Ledger('words', write('image', 'one'), { LEDGER });
  one.note(0, 'done');
  assert.equal(new Ledger('trips', write('image', 'one'), { LEDGER }).results.size, 0);
  assert.equal(new Ledger('words', write('other', 'two'), { LEDGER }).results.size, 0);
  assert.equal(new Ledger('words', write('image', 'one'), { LEDGER }).results.size, 1);
});

test('no item begins after the time is over', () => {
  const ledger = new Ledger('words', write('image', 'one'), { SECONDS: '0' });
  assert.deepEqual([...ledger.left(items)], []);
});
