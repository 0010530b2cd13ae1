// SPDX-License-Identifier: Apache-2.0
// Makes the screenshots of docs/howto-view.md.
// usage: node tests/viewer/pictures.mjs SYMRIG CHROMIUM [FOLDER]     default: docs/images
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { idle, kDesktop, kPhone, launch, open_page, press, run, serve, set_control, start } from './browser.mjs';

const [symrig, chromium, target = 'docs/images'] = process.argv.slice(2);
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'symrig-view-'));
const scene = path.join(folder, 'scene.h5');
const kSmall = { ...kDesktop, deviceScaleFactor: 1 };

async function shot(page, name) {
  await idle(page);
  await page.screenshot({ path: path.join(target, `view-${name}.png`) });
}

const spot = (x, y, colour) => ({ kind: 'spot', colour, power: 1.2, x, y, size: 0.11, soft: 0.4 });

async function two_lights(page) {
  await page.evaluate((lights) => { symrigView.state.lights = lights; symrigView.choose_light(0); }, [spot(0.25, 0.35, '#ffb347'), spot(0.78, 0.62, '#5aa9ff')]);
  await page.evaluate('symrigView.change({})');
}

/** A capture on its way. */
async function running_capture(browser) {
  const capture = await start(symrig, ['capture', '--rig', 'sim:gummy?size=256x256', '-o', path.join(folder, 'live.h5'), '--watch', '--no-log']);
  const { page } = await open_page(browser, capture.address, { viewport: kSmall });
  await page.waitForFunction('symrigCapture.tensor >= 6');
  await shot(page, 'capture');
  await capture.end();
}

run(symrig, ['capture', '--rig', 'sim:vgroove-textured?size=128x128', '-o', scene]);
const server = await serve(symrig, scene);
const browser = await launch(chromium);
try {
  const light = await open_page(browser, server.address, { viewport: kSmall });
  await two_lights(light.page);
  await shot(light.page, 'lights');
  await press(light.page, 'Remove this light');
  await press(light.page, 'Remove this light');
  await press(light.page, '+ Bar');
  await set_control(light.page, 'Show beside', 'truth');
  await set_control(light.page, 'Show the difference instead', true);
  await set_control(light.page, 'Gain', '6');
  await set_control(light.page, 'Lay over', 'levels');
  await shot(light.page, 'compare');
  const phone = await open_page(browser, server.address, { viewport: kPhone, dark: true });
  await two_lights(phone.page);
  await shot(phone.page, 'phone');
  await running_capture(browser);
} finally {
  await browser.close();
  await server.end();
  fs.rmSync(folder, { recursive: true });
}
