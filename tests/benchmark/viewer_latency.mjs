// SPDX-License-Identifier: Apache-2.0
// How long the page of `symrig view` takes from a pointer event to its picture, for each engine, and how far its picture is from that
// of `symrig relight`. A spot is dragged on a circle; an event follows when the picture of the last one is shown.
// usage: node tests/benchmark/viewer_latency.mjs SYMRIG CHROMIUM [SIZE or SCENE.h5 [MOVES]]     default: 310x350 60; needs `npm ci` in tests/viewer
// Of a scene file, only the served page is measured.
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { idle, launch, open_page, pfm_values, run, serve } from '../viewer/browser.mjs';

const [symrig, chromium, size = '310x350', moves = '60'] = process.argv.slice(2);
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'symrig-latency-'));
const file = (name) => path.join(folder, name);
const given = size.endsWith('.h5'), scene = given ? size : file('scene.h5');
const at = (list, share) => [...list].sort((a, b) => a - b)[Math.floor(share * (list.length - 1))];
const load = () => os.loadavg()[0].toFixed(1);

/** The largest difference of the flood-lit picture, as a share of the brightest pixel. */
async function flood_error(page) {
  run(symrig, ['relight', scene, '--light', 'white', '-o', file('flood.pfm')]);
  const theirs = pfm_values(fs.readFileSync(file('flood.pfm'))), ours = await page.evaluate('[...symrigView.flood[0]]');
  const [rows, cols] = await page.evaluate('symrigView.facts.camera'), channels = theirs.length / ours.length;
  let apart = 0, most = 0;
  for (let k = 0; k < ours.length; ++k) {
    const value = theirs[((rows - 1 - Math.floor(k / cols)) * cols + (k % cols)) * channels];
    apart = Math.max(apart, Math.abs(value - ours[k]));
    most = Math.max(most, value);
  }
  return apart / most;
}

async function measure(browser, name, address) {
  const { page, faults } = await open_page(browser, address);
  const box = await (await page.$('#picture')).boundingBox();
  const place = (angle) => [box.x + box.width * (0.5 + 0.3 * Math.cos(angle)), box.y + box.height * (0.5 + 0.3 * Math.sin(angle))];
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  for (let k = 0; k < Number(moves) + 5; ++k) {
    if (k === 5) await page.evaluate('symrigView.waits = []'); // the first ones compile the page's code
    await page.mouse.move(...place(k / 6));
    await idle(page);
    await page.evaluate('new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)))');
  }
  await page.mouse.up();
  const waits = await page.evaluate('symrigView.waits');
  const begin = await page.evaluate('performance.now()');
  await page.evaluate('symrigView.whole()');
  const whole = (await page.evaluate('performance.now()')) - begin;
  const error = await flood_error(page);
  console.log(`${name}: median ${at(waits, 0.5).toFixed(1)} ms, 9 in 10 within ${at(waits, 0.9).toFixed(1)} ms, ${waits.length} pictures; the whole picture ${whole.toFixed(0)} ms; ` +
    `flood-lit picture ${error.toExponential(1)} of the brightest pixel off; load ${load()}`);
  if (faults.length > 0) throw new Error(faults.join('\n'));
  await page.close();
}

if (!given) {
  run(symrig, ['capture', '--rig', `sim:vgroove-textured?size=${size}`, '-o', scene, '--no-log']);
  run(symrig, ['view', scene, '--export', file('scene.html'), '--max-mb', '100']);
}
const browser = await launch(chromium), server = await serve(symrig, scene);
try {
  console.log(`${size}, ${await browser.version()}, ${os.cpus().length} cores`);
  await measure(browser, given ? 'served page' : 'served page, kernel', server.address);
  if (!given) await measure(browser, 'exported page, kernel', `file://${file('scene.html')}`);
  if (!given) await measure(browser, 'served page, server', `${server.address}?engine=server`);
} finally {
  await browser.close();
  await server.end();
  fs.rmSync(folder, { recursive: true });
}
