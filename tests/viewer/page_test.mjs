// SPDX-License-Identifier: Apache-2.0
// The page of `symrig view` in Chromium: served with both engines, exported, and of a camera with pixels of its own. Reports on a phone.
// usage: node page_test.mjs SYMRIG CHROMIUM
import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { grey_png, idle, kDesktop, kPhone, launch, listen_to, open_page, pfm_values, png_codes, press, run, serve, set_control, shown_codes, start } from './browser.mjs';

const [symrig, chromium] = process.argv.slice(2);
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'symrig-view-'));
const file = (name) => path.join(folder, name);
const kRows = 32, kCols = 48;
const kCells = 32, kCamera = 152;
const kFine = `sim:gummy?size=${kCells}x${kCells}&fine=4&camera=${kCamera}x${kCamera}&turn=1.5&zoom=0.784`;

function prepare() {
  run(symrig, ['capture', '--rig', `sim:vgroove-textured?size=${kRows}x${kCols}&noise=off`, '-o', file('scene.h5')]);
  run(symrig, ['view', file('scene.h5'), '--export', file('scene.html')]);
  // No symmetry, so a picture that is turned or mirrored cannot pass.
  fs.writeFileSync(file('light.png'), grey_png(kRows, kCols, (r, c) => (r < 9 && c > 20 ? 255 : c < 5 ? 10 * r % 256 : (r * 37 + c * 11) % 97)));
  run(symrig, ['relight', file('scene.h5'), '--light', file('light.png'), '-o', file('relit.png')]);
  run(symrig, ['relight', file('scene.h5'), '--light', file('light.png'), '-o', file('relit.pfm')]);
}

/** The largest difference of two lists. */
const apart = (a, b) => {
  assert.equal(a.length, b.length);
  let most = 0;
  for (let k = 0; k < a.length; ++k) most = Math.max(most, Math.abs(a[k] - b[k]));
  return most;
};
const largest = (values) => values.reduce((most, v) => Math.max(most, Math.abs(v)), 0);

async function upload(page, name) {
  const input = await page.$('input[type=file]');
  await input.uploadFile(name);
  await page.waitForFunction("symrigView.state.lights.some((light) => light.kind === 'picture')");
  await idle(page);
}

/** The new page shows the scene, and what is used most often, without scrolling. */
async function opens_ready_to_use(page) {
  const [shown, flood] = await page.evaluate(() => [symrigView.shown, { planes: symrigView.flood }].map((one) => one.planes[0].reduce((sum, v) => sum + v, 0)));
  assert.ok(shown > 0.4 * flood, `${shown} of ${flood}`);
  const codes = await shown_codes(page), bright = codes.filter((code, k) => k % 4 === 0 && code > 200).length;
  assert.ok(bright > codes.length / 4 / 200, String(bright));
  const below = await page.evaluate((height) => [...document.querySelectorAll('#save button, #tone input, #tone select, #picture')]
    .filter((one) => one.getBoundingClientRect().bottom > height).map((one) => one.outerHTML), kDesktop.height);
  assert.deepEqual(below, []);
}

/** The uploaded picture alone: the same codes as the PNG of `symrig relight`. */
async function pixels_are_those_of_relight(browser, page, light = 'light.png', relit = 'relit.png') {
  await press(page, 'Remove this light');
  await upload(page, file(light));
  await set_control(page, 'Automatic: half a percent is white', true);
  const expected = await png_codes(browser, fs.readFileSync(file(relit)));
  const seen = await shown_codes(page);
  assert.ok(largest(expected.filter((_, k) => k % 4 === 0)) === 255);
  const most = apart(seen, expected);
  assert.ok(most <= 1, `${most} codes off`);
  return most;
}

/** The saved EXR as a light gives what the picture of `symrig relight` as a light gives. */
async function saved_exr_is_the_radiance(page) {
  const session = await page.createCDPSession();
  await session.send('Browser.setDownloadBehavior', { behavior: 'allow', downloadPath: folder });
  fs.rmSync(file('scene-relit.exr'), { force: true });
  await press(page, 'OpenEXR');
  for (let k = 0; k < 200 && !fs.existsSync(file('scene-relit.exr')); ++k) await new Promise((resolve) => setTimeout(resolve, 50));
  const head = fs.readFileSync(file('scene-relit.exr')).subarray(0, 800).toString('latin1');
  for (const fact of ['symrigExposure\0float\0', 'radiance per unit of projector light', 'symrigView\0string\0']) assert.ok(head.includes(fact), fact);
  const [ours, theirs] = ['scene-relit.exr', 'relit.pfm'].map((light) => {
    run(symrig, ['relight', file('scene.h5'), '--light', file(light), '-o', file('again.pfm')]);
    return pfm_values(fs.readFileSync(file('again.pfm')));
  });
  // The kernel's sums have 32 bits, and a reply of the server has 16-bit floats: 2^-11 of each value at most.
  assert.ok(apart(ours, theirs) <= 2 ** -10 * largest(theirs), `${apart(ours, theirs)} of ${largest(theirs)}`);
}

async function drags_a_light(page) {
  await press(page, '+ Spot');
  const before = await shown_codes(page), box = await (await page.$('#picture')).boundingBox();
  const at = (x, y) => [box.x + x * box.width, box.y + y * box.height];
  await page.mouse.move(...at(0.5, 0.5));
  await page.mouse.down();
  await page.mouse.move(...at(0.25, 0.75), { steps: 5 });
  await page.mouse.up();
  await idle(page);
  const light = await page.evaluate('symrigView.state.lights[symrigView.state.chosen]');
  assert.ok(Math.abs(light.x - 0.25) < 0.01 && Math.abs(light.y - 0.75) < 0.01, JSON.stringify(light));
  assert.ok(apart(before, await shown_codes(page)) > 20);
  assert.match(await page.$eval('#readout', (one) => one.textContent), /^row \d+, column \d+: [\d.e-]+/);
}

async function works_by_keyboard(page) {
  await page.focus('#picture');
  const place = () => page.evaluate('symrigView.state.lights[symrigView.state.chosen].x * symrigView.facts.projector[1]');
  const before = await place();
  await page.keyboard.press('ArrowRight');
  await page.keyboard.down('Shift');
  await page.keyboard.press('ArrowRight');
  await page.keyboard.up('Shift');
  await idle(page);
  assert.ok(Math.abs((await place()) - before - 11) < 1e-6);
  const lights = await page.evaluate('symrigView.state.lights.length');
  await page.keyboard.press('Delete');
  assert.equal(await page.evaluate('symrigView.state.lights.length'), lights - 1);
  await set_control(page, 'Paint light with the brush', true);
  await page.focus('#picture');
  await page.evaluate('symrigView.state.pixel = [0.7, 0.3]');
  const unpainted = await shown_codes(page);
  await page.keyboard.press('Space');
  await idle(page);
  assert.ok(apart(unpainted, await shown_codes(page)) > 20);
  await press(page, 'Remove this light');
  await set_control(page, 'Move lights', true);
  const unnamed = await page.evaluate(() => [...document.querySelectorAll('#panel input, #panel select, #panel button')]
    .filter((one) => !one.labels?.length && !one.textContent.trim() && !one.getAttribute('aria-label')).map((one) => one.outerHTML));
  assert.deepEqual(unnamed, []);
}

/** T is symmetric: the column of a pixel is its row. */
async function a_row_is_a_column(page) {
  await page.evaluate('symrigView.state.pixel = [0.3, 0.6]');
  await set_control(page, 'Light one projector pixel (a column of T)', true);
  const column = await page.evaluate('[...symrigView.shown.planes[0]]');
  await set_control(page, 'Show which light one camera pixel sees (a row of T)', true);
  const row = await page.evaluate('[...symrigView.shown.planes[0]]');
  assert.ok(largest(column) > 0 && apart(row, column) <= 1e-6 * largest(column));
  await set_control(page, 'Move lights', true);
}

async function coloured_lights_add_up(page) {
  const red = await page.evaluate(async () => {
    symrigView.state.lights = [{ kind: 'flood', colour: '#ff0000', power: 1, x: 0.5, y: 0.5 }];
    symrigView.latest.request();
    await symrigView.latest.idle();
    return symrigView.shown.planes.map((plane) => plane.reduce((sum, v) => sum + v, 0));
  });
  assert.ok(red.length === 3 && red[0] > 0 && red[1] === 0 && red[2] === 0, String(red));
}

async function a_link_restores_the_state(browser, page) {
  await page.evaluate(() => { symrigView.state.lights = []; });
  await press(page, '+ Bar');
  await set_control(page, 'Angle', '33');
  await set_control(page, 'Curve', 'log');
  await press(page, 'Copy a link to this state');
  const codes = await shown_codes(page), address = page.url();
  assert.match(address, /#[\w-]{100,}$/);
  const other = await open_page(browser, address);
  assert.equal(apart(await shown_codes(other.page), codes), 0);
  assert.deepEqual(other.faults, []);
  await other.page.close();
  const damaged = await open_page(browser, address.replace(/#.*/, '#eyJsaWdodHMiOjF9'));
  assert.deepEqual(damaged.faults, []);
  await damaged.page.close();
}

async function shows_levels_and_ranks(page) {
  for (const what of ['levels', 'ranks']) {
    await set_control(page, 'Lay over', what);
    const legend = await page.$$eval('#legend li', (found) => found.map((one) => one.textContent));
    assert.ok(legend.length > 0 && legend[0].startsWith(what.slice(0, -1)), String(legend));
  }
  await set_control(page, 'Lay over', 'none');
}

async function compares(page, has_truth) {
  const kinds = await page.evaluate(() => [...[...document.querySelectorAll('label')].find((one) => one.textContent === 'Show beside').control.options].map((one) => one.value));
  assert.equal(kinds.includes('truth'), has_truth);
  for (const kind of kinds) {
    await set_control(page, 'Show beside', kind);
    assert.equal(await page.$eval('#other-figure', (one) => one.hidden), kind === 'none', kind);
    const summary = await page.$eval('#summary', (one) => one.textContent);
    if (kind !== 'truth' && !kind.startsWith('held:')) continue;
    const share = Number(/: ([\d.e-]+) %/.exec(summary)?.[1]);
    assert.ok(share > 0 && share < 10, `${kind}: ${summary}`);
  }
  await set_control(page, 'Show beside', 'none');
}

async function animates(page) {
  await page.evaluate(() => { symrigView.state.lights = []; });
  await press(page, '+ Spot');
  await page.evaluate(() => [...document.querySelectorAll('button')].find((one) => one.textContent === 'Play').click());
  await page.waitForFunction('symrigView.phase > 0.05');
  await page.evaluate(() => [...document.querySelectorAll('button')].find((one) => one.textContent === 'Stop').click());
  assert.equal(await page.evaluate('symrigView.playing'), false);
}

async function fits_a_phone(browser, address) {
  const { page, faults } = await open_page(browser, address, { viewport: kPhone, dark: true });
  const wide = await page.evaluate('document.documentElement.scrollWidth');
  assert.ok(wide <= kPhone.width, `${wide} pixels wide`);
  const box = await (await page.$('#picture')).boundingBox();
  assert.ok(box.y + box.height < kPhone.height && box.width > 300, JSON.stringify(box));
  const before = await shown_codes(page);
  await page.touchscreen.tap(box.x + 0.2 * box.width, box.y + 0.2 * box.height);
  await idle(page);
  assert.ok(apart(before, await shown_codes(page)) > 20);
  assert.deepEqual(faults, []);
  await page.close();
}

/** No column of a report lies outside a phone's screen. */
async function report_fits_a_phone(browser) {
  run(symrig, ['report', file('scene.h5'), '-o', file('report.html')]);
  const page = await browser.newPage(), { faults } = listen_to(page);
  await page.setViewport(kPhone);
  await page.goto(`file://${file('report.html')}`);
  const tables = await page.evaluate(() => [...document.querySelectorAll('div.wide')].map((one) => [one.ariaLabel, one.scrollWidth, one.clientWidth]));
  assert.ok(tables.length > 3);
  for (const [name, wide, seen] of tables) assert.ok(wide <= seen, `${name}: ${wide} of ${seen} pixels are seen`);
  assert.deepEqual(faults, []);
  await page.close();
}

async function whole_page(browser, address, { origin, has_truth }) {
  const { page, faults, asked } = await open_page(browser, address);
  await opens_ready_to_use(page);
  const most = await pixels_are_those_of_relight(browser, page);
  await saved_exr_is_the_radiance(page);
  await drags_a_light(page);
  await works_by_keyboard(page);
  await a_row_is_a_column(page);
  await compares(page, has_truth);
  await shows_levels_and_ranks(page);
  await coloured_lights_add_up(page);
  await animates(page);
  await a_link_restores_the_state(browser, page);
  assert.deepEqual(faults, []);
  const foreign = asked.filter((one) => !/^(blob|data):/.test(one) && !one.startsWith(origin));
  assert.deepEqual(foreign, []);
  await page.close();
  await fits_a_phone(browser, address);
  console.log(`${address.replace(/[0-9a-f]{32}/, 'SECRET')}: at most ${most} codes from symrig relight`);
}

/** A page of lower resolution says so, and its flood-lit scene is the mean of the whole one. */
async function a_reduced_page_says_so(browser) {
  const told = run(symrig, ['view', file('scene.h5'), '--export', file('small.html'), '--max-mb', '0.2']);
  assert.match(told, /16x16.*\n.*lower resolution/);
  const { page, faults } = await open_page(browser, `file://${file('small.html')}`);
  assert.match(await page.$eval('#facts', (one) => one.textContent), /lower resolution.*32x48/);
  run(symrig, ['relight', file('scene.h5'), '--light', 'white', '-o', file('flood.pfm')]);
  const flood = pfm_values(fs.readFileSync(file('flood.pfm'))), small = await page.evaluate('[...symrigView.flood[0]]');
  const mean = small.map((_, k) => {
    const row = Math.floor(k / 16), col = k % 16;
    let sum = 0;
    // Blocks of 2x3 pixels. Rows of a PFM file begin at the bottom.
    for (let r = 2 * row; r < 2 * row + 2; ++r) for (let c = 3 * col; c < 3 * col + 3; ++c) sum += flood[(kRows - 1 - r) * kCols + c];
    return sum / 6;
  });
  // Rounding of the sums of factors: 2^-11 of each.
  assert.ok(apart(small, mean) <= 2 ** -10 * largest(mean), String(apart(small, mean)));
  assert.deepEqual(faults, []);
  await page.close();
}

/** Colour, several views, measured columns, and bands: the flood-lit scene of the exported page is that of `symrig relight`. */
async function other_scenes_are_the_same(browser) {
  const scenes = [['sim:views2?size=16x20&noise=off&channels=3'], ['sim:plane?size=16x20&noise=off&psf=0.1'],
    ['sim:gummy?size=12x10&noise=off', '--algorithm', 'brute']];
  for (const [rig, ...options] of scenes) {
    run(symrig, ['capture', '--rig', rig, '-o', file('other.h5'), ...options]);
    run(symrig, ['view', file('other.h5'), '--export', file('other.html')]);
    run(symrig, ['relight', file('other.h5'), '--light', 'white', '-o', file('other.pfm')]);
    const { page, faults } = await open_page(browser, `file://${file('other.html')}`);
    const { rows, cols, planes } = await page.evaluate('({ rows: symrigView.facts.camera[0], cols: symrigView.facts.camera[1], planes: symrigView.flood.map((plane) => [...plane]) })');
    const stored = pfm_values(fs.readFileSync(file('other.pfm')));
    const same = Array.from(stored, (_, k) => {
      const channel = k % planes.length, at = Math.floor(k / planes.length);
      return planes[channel][(rows - 1 - Math.floor(at / cols)) * cols + (at % cols)];
    });
    // Measured columns are rounded to 16-bit floats.
    assert.ok(apart(same, stored) <= 2 ** -10 * largest(stored), `${rig}: ${apart(same, stored)} of ${largest(stored)}`);
    assert.deepEqual(faults, []);
    if (rig.includes('views2')) {
      await set_control(page, 'Lit from', '0,1');
      await set_control(page, 'Seen from', '1,0');
      assert.deepEqual(await page.evaluate('[symrigView.shown.tile.rows, symrigView.shown.tile.cols]'), [rows / 2, cols / 2]);
    }
    await page.close();
  }
}

function prepare_camera() {
  run(symrig, ['calibrate', '--rig', kFine, '-o', file('r.h5')]);
  run(symrig, ['capture', '--rig', kFine, '--registration', file('r.h5'), '-o', file('camera.h5')]);
  fs.writeFileSync(file('cells.png'), grey_png(kCells, kCells, (r, c) => (r < 9 && c > 20 ? 255 : (r * 37 + c * 11) % 97)));
  run(symrig, ['relight', file('camera.h5'), '--light', file('cells.png'), '-o', file('own.png')]);
}

/** Where the light of a spot is on the picture: the middle of the pixels that it lights about as much as all light does. */
const place_of_light = (page) => page.evaluate(() => {
  const { planes: [lit], tile } = symrigView.shown, [flood] = symrigView.flood, most = flood.reduce((a, b) => Math.max(a, b));
  const sum = [0, 0, 0];
  lit.forEach((v, k) => {
    if (flood[k] < 0.02 * most || v < 0.5 * flood[k]) return;
    [(k % tile.cols + 0.5) / tile.cols, (Math.floor(k / tile.cols) + 0.5) / tile.rows, 1].forEach((one, axis) => { sum[axis] += (one * v) / flood[k]; });
  });
  return [sum[0] / sum[2], sum[1] / sum[2]];
});

/** The alpha of the overlay at a place: a light's handle has a dot in its middle. */
const drawn_at = (page, [x, y]) => page.evaluate((u, v) => {
  const overlay = document.getElementById('overlay');
  const copy = Object.assign(document.createElement('canvas'), { width: overlay.width, height: overlay.height });
  const context = copy.getContext('2d', { willReadFrequently: true });
  context.drawImage(overlay, 0, 0);
  return context.getImageData(Math.floor(u * copy.width), Math.floor(v * copy.height), 1, 1).data[3];
}, x, y);

/** The camera is turned, and its picture is larger than the cells' field: a light is where the pointer is, to a cell. */
async function light_follows_the_pointer(page) {
  const cell = 0.784 / kCells, box = await (await page.$('#picture')).boundingBox();
  const at = ([x, y]) => [box.x + x * box.width, box.y + y * box.height];
  const near = async (place, what) => {
    const seen = await place_of_light(page);
    assert.ok(apart(seen, place) < cell, `${what}: ${seen} instead of ${place}`);
  };
  await page.evaluate(() => { symrigView.state.lights = []; });
  await press(page, '+ Spot');
  await set_control(page, 'Size', '0.08');
  await page.mouse.move(...at([0.5, 0.5]));
  await page.mouse.down();
  for (const place of [[0.2, 0.25], [0.75, 0.3], [0.3, 0.7], [0.75, 0.78]]) {
    await page.mouse.move(...at(place));
    await idle(page);
    await near(place, 'a spot');
    assert.equal(await drawn_at(page, place), 255);
    assert.equal(await drawn_at(page, [place[0] + 0.06, place[1]]), 0);
  }
  await page.mouse.up();
  await page.focus('#picture');
  await page.keyboard.down('Shift');
  await page.keyboard.press('ArrowLeft');
  await page.keyboard.up('Shift');
  await idle(page);
  await near([0.75 - 10 / kCamera, 0.78], 'a spot, ten camera pixels further left');
  await set_control(page, 'Light one projector pixel (a column of T)', true);
  await page.mouse.move(...at([0.22, 0.3]));
  await idle(page);
  await near([0.22, 0.3], 'one cell');
  assert.equal(await drawn_at(page, [0.22 + 8 / box.width, 0.3]), 255); // the cross, whose middle is free
  await page.mouse.move(...at([0.02, 0.02])); // where no cell is
  await idle(page);
  await set_control(page, 'Move lights', true);
}

/** The row of T of the pixel under the pointer is on the cells: most light comes from the cell that it looks at. */
async function a_camera_pixel_sees_its_cell(page) {
  await page.evaluate('symrigView.state.pixel = [0.2, 0.7]');
  await set_control(page, 'Show which light one camera pixel sees (a row of T)', true);
  const { rows, cols, most } = await page.evaluate(() => {
    const { planes: [plane], tile } = symrigView.shown;
    return { ...tile, most: plane.indexOf(plane.reduce((a, b) => Math.max(a, b))) };
  });
  assert.deepEqual([rows, cols], [kCells, kCells]);
  // Between the cells, the pixel may look at a neighbour.
  assert.ok(Math.abs((most % cols) + 0.5 - 0.2 * cols) <= 1.5 && Math.abs(Math.floor(most / cols) + 0.5 - 0.7 * rows) <= 1.5, String(most));
  await set_control(page, 'Move lights', true);
}

/** Truth and held-out photographs are on the cells, so they stand beside the picture and have no difference from it. */
async function compares_with_the_cells(page) {
  const sizes = {};
  for (const kind of ['light', 'flood', 'truth', 'dual', 'held:0']) {
    await set_control(page, 'Show beside', kind);
    sizes[kind] = await page.$eval('#other', (one) => [one.height, one.width]);
    assert.equal(await page.$eval('#summary', (one) => one.textContent), '', kind);
  }
  const cells = [kCells, kCells];
  assert.deepEqual(sizes, { light: cells, flood: [kCamera, kCamera], truth: cells, dual: cells, 'held:0': cells });
  await set_control(page, 'Show beside', 'none');
}

/** A scene with many camera pixels: fewer of them while something moves, and all of them afterwards and in a file. */
async function moves_quickly(page) {
  await page.evaluate((step) => {
    const { facts, engine } = symrigView, [rows, cols] = facts.camera;
    facts.quick = [rows / step, cols / step];
    engine.quick = async (light, pixels) => (await engine.relight(light, rows * cols)).map((plane) =>
      Float32Array.from({ length: pixels }, (_, k) => plane[Math.floor(k / facts.quick[1]) * step * cols + (k % facts.quick[1]) * step]));
  }, 4);
  const shown = () => page.evaluate('symrigView.shown.planes[0].length');
  const box = await (await page.$('#picture')).boundingBox();
  await page.evaluate('symrigView.whole()');
  assert.equal(await shown(), kCamera ** 2);
  await page.mouse.move(box.x + 100, box.y + 200);
  await page.mouse.down();
  await page.evaluate('symrigView.still_at = performance.now() + 1e6'); // however long a picture takes
  await page.evaluate('symrigView.latest.request()');
  await idle(page);
  assert.equal(await shown(), (kCamera / 4) ** 2);
  const now = await (await page.$('#picture')).boundingBox();
  assert.deepEqual([now.width, now.height], [box.width, box.height]);
  assert.match(await page.$eval('#readout', (one) => one.textContent), new RegExp(`^row ${Math.floor((200 / box.height) * kCamera)}, `));
  await page.mouse.move(box.x + 120, box.y + 220);
  await page.mouse.up();
  await page.waitForFunction(`symrigView.shown.planes[0].length === ${kCamera ** 2}`);
  await page.evaluate('delete symrigView.facts.quick');
}

async function camera_page(browser) {
  prepare_camera();
  const server = await serve(symrig, file('camera.h5'));
  try {
    const { page, faults } = await open_page(browser, server.address);
    assert.match(await page.$eval('#facts', (one) => one.textContent), /the camera's own pixels.*projector 32x32, camera 152x152.*relit by symrig/);
    await opens_ready_to_use(page);
    await light_follows_the_pointer(page);
    await a_camera_pixel_sees_its_cell(page);
    await compares_with_the_cells(page);
    await shows_levels_and_ranks(page);
    await moves_quickly(page);
    await pixels_are_those_of_relight(browser, page, 'cells.png', 'own.png');
    assert.deepEqual(faults, []);
    await page.close();
    await fits_a_phone(browser, server.address);
  } finally {
    assert.equal(await server.end(), 0);
  }
}

/** With --cells, and in a file, the page is that of the cells. */
async function camera_page_of_the_cells(browser) {
  run(symrig, ['view', file('camera.h5'), '--export', file('camera.html')]);
  run(symrig, ['relight', file('camera.h5'), '--light', file('cells.png'), '--cells', '-o', file('on-cells.png')]);
  const server = await start(symrig, ['view', file('camera.h5'), '--cells']);
  try {
    for (const address of [server.address, `file://${file('camera.html')}`]) {
      const { page, faults } = await open_page(browser, address);
      assert.match(await page.$eval('#facts', (one) => one.textContent), /the projector's cells, 32x32 pixels.*relit by this page/);
      await pixels_are_those_of_relight(browser, page, 'cells.png', 'on-cells.png');
      assert.deepEqual(faults, []);
      await page.close();
    }
  } finally {
    assert.equal(await server.end(), 0);
  }
}

prepare();
const browser = await launch(chromium);
try {
  const server = await serve(symrig, file('scene.h5'));
  try {
    await whole_page(browser, server.address, { origin: server.address, has_truth: true });
    await whole_page(browser, `${server.address}?engine=server`, { origin: server.address, has_truth: true });
  } finally {
    assert.equal(await server.end(), 0);
  }
  await whole_page(browser, `file://${file('scene.html')}`, { origin: `file://${file('scene.html')}`, has_truth: false });
  await report_fits_a_phone(browser);
  await a_reduced_page_says_so(browser);
  await other_scenes_are_the_same(browser);
  await camera_page(browser);
  await camera_page_of_the_cells(browser);
} finally {
  await browser.close();
  fs.rmSync(folder, { recursive: true });
}
