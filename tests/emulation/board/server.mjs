// SPDX-License-Identifier: Apache-2.0
// Serves an emulated board on the virtual link:
//   node tests/emulation/board/server.mjs --uf2 FILE (--unix PATH | --tcp HOST:PORT) [--vcd FILE] [--dma-cycles N] [--drive FOLDER]
// Prints one line when it is ready. One client at a time; the board stays as it is when a client goes. FOLDER becomes the boot
// loader's drive while the board is in its boot loader.

import fs from 'node:fs';
import net from 'node:net';
import { parseArgs } from 'node:util';
import { BootDrive } from './image.mjs';
import { frame, FrameReader } from './link.mjs';
import { BoardSession } from './session.mjs';

const DRIVE_POLL_MS = 100;
const LEAVING_MS = 200;

/** `onGone()`: a client has left. */
export function serve(session, onGone = () => {}) {
  let client = null;
  const attend = (socket) => {
    client = socket;
    socket.setNoDelay?.(true);
    const reader = new FrameReader();
    socket.on('data', (bytes) => {
      try {
        for (const message of reader.push(bytes)) socket.write(session.answer(message));
      } catch (error) {
        socket.end(frame('x', Buffer.from(error.message)));
      }
    });
    socket.on('close', () => {
      client = null;
      session.writeVcd();
      onGone();
    });
  };
  const refuse = (socket) => socket.end(frame('x', Buffer.from('another client is connected')));
  return net.createServer((socket) => {
    socket.on('error', () => {});
    if (!client) return attend(socket);
    // The next client may be seen before the end of the one that has just left.
    setTimeout(() => (client ? refuse(socket) : attend(socket)), LEAVING_MS);
    return undefined;
  });
}

const text = { type: 'string' };
const OPTIONS = { uf2: text, unix: text, tcp: text, vcd: text, drive: text, 'dma-cycles': { ...text, default: '1' } };

function usage() {
  console.error('usage: server.mjs --uf2 FILE (--unix PATH | --tcp HOST:PORT) [--vcd FILE] [--dma-cycles N] [--drive FOLDER]');
  process.exit(2);
}

/** Where to listen, as node takes it. */
function placeOf({ unix, tcp }) {
  if (unix) return { path: unix };
  const at = tcp.lastIndexOf(':');
  return { host: tcp.slice(0, at), port: Number(tcp.slice(at + 1)) };
}

const nameOf = (address) => (typeof address === 'string' ? `unix:${address}` : `tcp:${address.address}:${address.port}`);

function main() {
  const { values } = parseArgs({ options: OPTIONS });
  if (!values.uf2 || Boolean(values.unix) === Boolean(values.tcp)) usage();
  const session = new BoardSession(fs.readFileSync(values.uf2), { vcdFile: values.vcd, dmaCycles: Number(values['dma-cycles']) });
  if (session.failure) console.error(`warning: ${session.failure}`);
  const drive = values.drive && new BootDrive(values.drive, session);
  if (drive) setInterval(() => drive.poll(), DRIVE_POLL_MS);
  if (values.unix) fs.rmSync(values.unix, { force: true });
  const server = serve(session, () => drive && session.goToBootloader());
  server.listen(placeOf(values), () => console.log(`ready virtual:${nameOf(server.address())}`));
  server.on('error', (error) => {
    console.error(`error: ${error.message}`);
    process.exit(1);
  });
  for (const signal of ['SIGINT', 'SIGTERM']) process.on(signal, () => stop(session, values.unix));
}

function stop(session, path) {
  session.writeVcd();
  if (path) fs.rmSync(path, { force: true });
  process.exit(0);
}

if (import.meta.url === `file://${process.argv[1]}` || process.argv[1]?.endsWith('board/server.mjs')) main();
