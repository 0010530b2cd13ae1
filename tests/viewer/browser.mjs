// SPDX-License-Identifier: Apache-2.0
// A browser that notes everything a page does wrong, and the files that the tests need.
import { execFileSync, spawn } from 'node:child_process';
import zlib from 'node:zlib';
import puppeteer from 'puppeteer-core';

export const kDesktop = { width: 1280, height: 900 };
export const kPhone = { width: 390, height: 844, deviceScaleFactor: 2, isMobile: true, hasTouch: true };

export function run(command, words) {
  return execFileSync(command, words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'inherit'] });
}

export function launch(chromium) {
  const args = ['--no-sandbox', '--disable-dev-shm-usage', '--disable-background-networking'];
  return puppeteer.launch({ executablePath: chromium, headless: true, args });
}

/** A command that serves a page: {address, printed, end}. printed(): its output so far. end() resolves with the exit code. */
export async function start(symrig, words) {
  const child = spawn(symrig, words, { stdio: ['ignore', 'pipe', 'inherit'] });
  const ended = new Promise((resolve) => child.on('exit', resolve));
  let printed = '';
  child.stdout.on('data', (data) => { printed += data; });
  while (!printed.includes('\n')) await new Promise((resolve) => child.stdout.once('data', resolve));
  return { address: printed.split('\n')[0], printed: () => printed, end: () => { child.kill('SIGINT'); return ended; } };
}

export const serve = (symrig, scene) => start(symrig, ['view', scene]);

/** From now on: what a page complains of, and every address that it asks for. */
export function listen_to(page) {
  const faults = [], asked = [];
  page.on('console', (message) => { if (['error', 'warn', 'warning'].includes(message.type())) faults.push(message.text()); });
  page.on('pageerror', (error) => faults.push(error.message));
  page.on('request', (request) => asked.push(request.url()));
  return { faults, asked };
}

/** A page with what it complained of, and every address that it asked for. */
export async function open_page(browser, address, { viewport = kDesktop, dark = false } = {}) {
  const page = await browser.newPage(), { faults, asked } = listen_to(page);
  await page.setViewport(viewport);
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: dark ? 'dark' : 'light' }]);
  if (address.startsWith('file:')) await page.setOfflineMode(true);
  await page.goto(address);
  await page.waitForFunction('window.symrigView !== undefined', { timeout: 120000 });
  return { page, faults, asked };
}

export const idle = (page) => page.evaluate('symrigView.latest.idle()');

/** The button of this name below an element. */
export async function press(page, name) {
  await page.evaluate((text) => {
    const found = [...document.querySelectorAll('button')].filter((one) => one.textContent === text);
    if (found.length !== 1) throw new Error(`${found.length} buttons "${text}"`);
    found[0].click();
  }, name);
  await idle(page);
}

/** Sets a labelled control, as a user does. */
export async function set_control(page, label, value) {
  await page.evaluate((text, given) => {
    const found = [...document.querySelectorAll('label')].find((one) => one.textContent.trim() === text);
    const control = found.control;
    if (control.type === 'checkbox' || control.type === 'radio') { if (control.checked !== given) control.click(); return; }
    control.value = given;
    control.dispatchEvent(new Event(control.tagName === 'SELECT' ? 'change' : 'input', { bubbles: true }));
  }, label, value);
  await idle(page);
}

/** A grey PNG of 8 bits. */
export function grey_png(rows, cols, code) {
  const lines = Buffer.alloc(rows * (cols + 1));
  for (let r = 0; r < rows; ++r) for (let c = 0; c < cols; ++c) lines[r * (cols + 1) + 1 + c] = code(r, c);
  const head = Buffer.alloc(13);
  head.writeUInt32BE(cols, 0);
  head.writeUInt32BE(rows, 4);
  head.set([8, 0, 0, 0, 0], 8);
  const part = (type, data) => {
    const body = Buffer.concat([Buffer.from(type), data]), size = Buffer.alloc(4), sum = Buffer.alloc(4);
    size.writeUInt32BE(data.length);
    sum.writeUInt32BE(own_crc32(body));
    return Buffer.concat([size, body, sum]);
  };
  return Buffer.concat([Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]), part('IHDR', head), part('IDAT', zlib.deflateSync(lines)), part('IEND', Buffer.alloc(0))]);
}

/** The checksum of a PNG chunk; Node 18 has none of its own. */
function own_crc32(bytes) {
  let sum = ~0;
  for (const byte of bytes) {
    sum ^= byte;
    for (let k = 0; k < 8; ++k) sum = (sum >>> 1) ^ (sum & 1 ? 0xedb88320 : 0);
  }
  return ~sum >>> 0;
}

/** The red codes of a PNG file, decoded by a page without our policy. */
export async function png_codes(browser, bytes) {
  const page = await browser.newPage();
  const codes = await page.evaluate(async (data) => {
    const image = new Image();
    image.src = `data:image/png;base64,${data}`;
    await image.decode();
    const canvas = Object.assign(document.createElement('canvas'), { width: image.width, height: image.height });
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    return [...context.getImageData(0, 0, image.width, image.height).data];
  }, bytes.toString('base64'));
  await page.close();
  return codes;
}

/** The codes on the canvas, from a copy: Chromium complains of a canvas that is read often. */
export const shown_codes = (page) => page.evaluate(() => {
  const canvas = document.getElementById('picture');
  const copy = Object.assign(document.createElement('canvas'), { width: canvas.width, height: canvas.height });
  const context = copy.getContext('2d', { willReadFrequently: true });
  context.drawImage(canvas, 0, 0);
  return [...context.getImageData(0, 0, copy.width, copy.height).data];
});

/** The values of a PFM file, in the order of the file. */
export function pfm_values(bytes) {
  let at = 0;
  for (let lines = 0; lines < 3; ++at) if (bytes[at] === 10) ++lines;
  return new Float32Array(bytes.buffer.slice(bytes.byteOffset + at, bytes.byteOffset + bytes.length));
}
