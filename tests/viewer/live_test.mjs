// SPDX-License-Identifier: Apache-2.0
// The page of `symrig capture --watch` in Chromium: before the first photograph, during the search, and afterwards. The rig waits for
// this test, so each state is seen however slow the machine is.
// usage: node live_test.mjs SYMRIG CHROMIUM PYTHON [SCREENSHOT]
import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { grey_png, idle, kDesktop, kPhone, launch, listen_to, png_codes, press, run, set_control, shown_codes, start } from './browser.mjs';

const [symrig, chromium, python, screenshot] = process.argv.slice(2);
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'symrig-live-'));
const file = (name) => path.join(folder, name);
const kSide = 24, kBegin = 1, kHeld = 40; // photographs before which the rig waits
const rig = `exec:exec ${python} -B ${path.join(import.meta.dirname ?? path.dirname(new URL(import.meta.url).pathname), 'gated_rig.py')} ${folder} ${kBegin} ${kHeld}`;

// What a gate says is there at once.
const open_gate = (number, said = '') => {
  fs.writeFileSync(file('gate'), said);
  fs.renameSync(file('gate'), file(`gate-${number}`));
};
const text = (page, id) => page.$eval(`#${id}`, (one) => one.textContent);
const hidden = (page, id) => page.$eval(`#${id}`, (one) => one.hidden);

/** Waits for a condition on the page; also of a page in the background, where nothing is animated. */
const until = (page, condition) => page.waitForFunction(condition, { timeout: 120000, polling: 100 });

async function open_live(browser, address, viewport = kDesktop) {
  const page = await browser.newPage(), heard = listen_to(page);
  await page.setViewport(viewport);
  await page.goto(address);
  await until(page, 'window.symrigCapture !== undefined || window.symrigView !== undefined');
  return { page, ...heard };
}

async function waits_for_the_first_photograph(page) {
  await until(page, "document.getElementById('capture-stage').textContent !== ''");
  assert.equal(await hidden(page, 'capture'), false);
  assert.equal(await hidden(page, 'main'), true);
  assert.match(await text(page, 'facts'), /A capture is running/);
}

async function shows_the_picture_so_far(page) {
  await until(page, 'window.symrigView !== undefined && symrigCapture.tensor >= 3');
  await idle(page);
  assert.equal(await hidden(page, 'main'), false);
  assert.match(await text(page, 'capture-stage'), /^Capturing: level \d+, \d+ of \d+ photographs$/);
  assert.match(await text(page, 'capture-numbers'), /^\d+ frames · 0 lost · .* of rig time · .* elapsed · /);
  const rows = await page.$$eval('#capture-levels tbody tr', (found) => found.map((one) => one.textContent));
  assert.ok(rows.length >= 2 && /%.*±.*%/.test(rows[0]), String(rows));
  assert.equal(await hidden(page, 'last-photograph-figure'), false);
  assert.match(await text(page, 'facts'), /the tensor so far/);
}

/** The visitor's light, on the tensor so far. */
async function relights_while_it_captures(page) {
  const before = await shown_codes(page);
  await press(page, '+ Bar');
  await set_control(page, 'Angle', '40');
  const after = await shown_codes(page);
  assert.ok(after.some((code, k) => Math.abs(code - before[k]) > 20));
  await set_control(page, 'Lay over', 'levels');
  await set_control(page, 'Lay over', 'none');
  await set_control(page, 'Show beside', 'dual');
  await set_control(page, 'Show beside', 'none');
}

/** The same page, with the visitor's lights, is now the page of the scene: its pixels are those of `symrig relight`. */
async function becomes_the_viewer(browser, page) {
  await until(page, "document.getElementById('capture').hidden");
  await until(page, '!symrigView.facts.live && symrigView.facts.packed');
  await idle(page);
  assert.deepEqual(await page.evaluate('symrigView.state.lights.map((one) => one.kind)'), ['spot', 'bar']);
  assert.match(await text(page, 'facts'), /relit by this page/);
  fs.writeFileSync(file('light.png'), grey_png(kSide, kSide, (r, c) => (r < 9 && c > 12 ? 255 : (r * 37 + c * 11) % 97)));
  run(symrig, ['relight', file('scene.h5'), '--light', file('light.png'), '-o', file('relit.png')]);
  await press(page, 'Remove this light');
  await press(page, 'Remove this light');
  await (await page.$('input[type=file]')).uploadFile(file('light.png'));
  await page.waitForFunction("symrigView.state.lights.some((light) => light.kind === 'picture')");
  await set_control(page, 'Automatic: half a percent is white', true);
  const expected = await png_codes(browser, fs.readFileSync(file('relit.png'))), seen = await shown_codes(page);
  const most = seen.reduce((sum, code, k) => Math.max(sum, Math.abs(code - expected[k])), 0);
  assert.ok(most <= 1, `${most} codes off`);
  const held = await page.$$eval('option', (found) => found.filter((one) => one.value.startsWith('held:')).length);
  const stored = JSON.parse(run(symrig, ['inspect', file('scene.h5'), '--json', '-'])).held_out;
  assert.ok(stored >= 6);
  assert.equal(held, stored);
}

/** The page and the terminal say the same, and the last picture stays. */
async function says_why_it_failed(browser) {
  for (const number of [kBegin, kHeld]) fs.rmSync(file(`gate-${number}`), { force: true });
  const failing = await start(symrig, ['capture', '--rig', rig, '-o', file('failed.h5'), '--watch']);
  const { page, faults } = await open_live(browser, failing.address);
  open_gate(kBegin);
  await shows_the_picture_so_far(page);
  open_gate(kHeld, 'fail');
  await until(page, "/without a scene/.test(document.getElementById('capture-stage').textContent)");
  assert.match(await text(page, 'capture-stage'), /^The capture has ended without a scene: exec:.* ended with status 3 before photograph 1 of 1; .*; .*failed\.h5\.log keeps 39 photographs: continue with --resume$/);
  assert.doesNotMatch(await text(page, 'capture-numbers'), /to go/);
  assert.equal(await hidden(page, 'capture-bar'), true);
  assert.equal(await hidden(page, 'main'), false);
  if (screenshot) await page.screenshot({ path: screenshot.replace('.png', '-failed.png') });
  assert.equal(await failing.end(), 3);
  assert.deepEqual(faults, []);
  await page.close();
}

const browser = await launch(chromium);
const capture = await start(symrig, ['capture', '--rig', rig, '-o', file('scene.h5'), '--watch']);
try {
  const { page, faults, asked } = await open_live(browser, capture.address);
  await waits_for_the_first_photograph(page);
  open_gate(kBegin);
  await shows_the_picture_so_far(page);
  await relights_while_it_captures(page);
  if (screenshot) await page.screenshot({ path: screenshot });
  const phone = await open_live(browser, capture.address, kPhone);
  await until(phone.page, 'window.symrigView !== undefined');
  assert.ok((await phone.page.evaluate('document.documentElement.scrollWidth')) <= kPhone.width);
  await idle(phone.page);
  const box = await (await phone.page.$('#picture')).boundingBox();
  assert.ok(box.y + box.height < kPhone.height, JSON.stringify(box));
  if (screenshot) await phone.page.screenshot({ path: screenshot.replace('.png', '-phone.png') });
  await phone.page.close();
  open_gate(kHeld);
  await becomes_the_viewer(browser, page);
  assert.deepEqual(faults, []);
  assert.deepEqual(phone.faults, []);
  assert.deepEqual(asked.filter((one) => !/^(blob|data):/.test(one) && !one.startsWith(capture.address)), []);
  assert.match(capture.printed(), /patterns[\s\S]*The page now shows the scene\. Ctrl-C ends\./);
  // The rest of its life is that of `symrig view`: Ctrl-C ends it, and it is no failure.
  await page.close();
  assert.equal(await capture.end(), 0);
  await says_why_it_failed(browser);
} finally {
  await browser.close();
  await capture.end();
  fs.rmSync(folder, { recursive: true });
}
