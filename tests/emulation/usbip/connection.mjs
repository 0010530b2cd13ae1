// SPDX-License-Identifier: Apache-2.0
// One client of the USB/IP server: lists and imports the device, then passes its transfers to the scripted host.

export class Connection {
  constructor(host, socket) {
    this.host = host;
    this.socket = socket;
    this.bytes = Buffer.alloc(0);
    this.attached = false;
    this.live = new Map(); // sequence number -> function that cancels the transfer
    this.onBus = (what) => what === 'detached' && this.attached && socket.destroy();
    host.listeners.add(this.onBus);
    socket.on('data', (bytes) => this.receive(bytes));
    socket.on('close', () => this.end());
    socket.on('error', () => {});
  }

  end() {
    this.host.listeners.delete(this.onBus);
    const all = [...this.live.values()];
    this.live.clear();
    for (const cancel of all) cancel();
  }

  receive(bytes) {
    this.bytes = Buffer.concat([this.bytes, bytes]);
    while (!this.importing) {
      const message = this.attached ? parseCommand(this.bytes) : parseOperation(this.bytes);
      if (!message) return;
      this.bytes = this.bytes.subarray(message.size);
      if (this.attached) this.command(message);
      else this.operation(message);
    }
  }

  operation({ code, busId }) {
    if (code === OP_REQ_DEVLIST) return this.socket.write(deviceList(this.host.device));
    if (code !== OP_REQ_IMPORT) return this.socket.destroy();
    if (busId !== BUS_ID || !this.host.device) return this.socket.end(imported(null));
    return this.import();
  }

  /** Like a fresh plug: bus reset and enumeration, then the device is the client's. */
  import() {
    this.importing = true;
    this.host.restart((device) => {
      this.importing = false;
      this.attached = true;
      this.socket.write(imported(device));
      this.receive(Buffer.alloc(0));
    });
  }

  command(message) {
    if (message.command === CMD_SUBMIT) this.submit(message);
    else if (message.command === CMD_UNLINK) this.unlink(message);
    else this.socket.destroy();
  }

  submit(message) {
    const { sequence, reads } = message;
    let over = false;
    const done = ({ status, data }) => {
      over = true;
      if (!this.live.delete(sequence)) return; // unlinked, or the client is gone
      const length = reads ? data.length : status === 'ok' ? message.length : 0;
      this.socket.write(submitted(sequence, STATUS[status], length, reads ? data : undefined));
    };
    this.live.set(sequence, () => {});
    const cancel = this.start(message, done);
    if (!over) this.live.set(sequence, cancel);
  }

  /** Starts a transfer and gives what cancels it. */
  start({ endpoint, reads, setup, data, length, flags }, done) {
    if (endpoint === 0) {
      const control = this.host.submitControl(setup, data, done);
      return () => this.host.cancelControl(control);
    }
    const terminated = (flags & URB_ZERO_PACKET) !== 0;
    const submitOut = terminated ? 'submitTerminated' : 'submitOut';
    const transfer = reads ? this.host.submitIn(endpoint, length, done) : this.host[submitOut](endpoint, data, done);
    return () => this.host.cancel(transfer);
  }

  /** UNLINK: ECONNRESET if the transfer was still on its way (it is then not answered itself), else 0. */
  unlink({ sequence, target }) {
    const cancel = this.live.get(target);
    this.live.delete(target);
    cancel?.();
    this.socket.write(unlinked(sequence, cancel ? STATUS.cancelled : 0));
  }
}

// USB/IP, version 1.1.1 (Linux, Documentation/usb/usbip_protocol.rst). All numbers are big endian.

export const VERSION = 0x0111;
export const OP_REQ_DEVLIST = 0x8005;
export const OP_REQ_IMPORT = 0x8003;
export const CMD_SUBMIT = 1;
export const CMD_UNLINK = 2;
export const RET_SUBMIT = 3;
export const RET_UNLINK = 4;
export const URB_ZERO_PACKET = 0x40;
export const HEADER = 48;
export const BUS_ID = '1-1';

const REQUEST = 8;
const IMPORT_REQUEST = 40;
const FULL_SPEED = 2;

/** Linux error numbers of a transfer's end. */
export const STATUS = { ok: 0, stall: -32, error: -71, gone: -108, cancelled: -104 };

/** The 312 bytes that describe a device. */
export function describe(device) {
  const bytes = Buffer.alloc(312);
  bytes.write('/sys/devices/emulated/usb1/1-1', 0);
  bytes.write(BUS_ID, 256);
  [1, 2, FULL_SPEED].forEach((word, i) => bytes.writeUInt32BE(word, 288 + 4 * i));
  [device.vendor, device.product, device.version].forEach((word, i) => bytes.writeUInt16BE(word, 300 + 2 * i));
  const { interfaces, value } = device.configuration;
  Buffer.from([...device.class, value, device.configurations, interfaces.length]).copy(bytes, 306);
  return bytes;
}

function operation(code, status, ...rest) {
  const head = Buffer.alloc(8);
  head.writeUInt16BE(VERSION, 0);
  head.writeUInt16BE(code & 0x7fff, 2);
  head.writeUInt32BE(status, 4);
  return Buffer.concat([head, ...rest]);
}

export function deviceList(device) {
  const count = Buffer.from([0, 0, 0, device ? 1 : 0]);
  if (!device) return operation(OP_REQ_DEVLIST, 0, count);
  const interfaces = device.configuration.interfaces.map((each) => Buffer.from([...each.class, 0]));
  return operation(OP_REQ_DEVLIST, 0, count, describe(device), ...interfaces);
}

export const imported = (device) => (device ? operation(OP_REQ_IMPORT, 0, describe(device)) : operation(OP_REQ_IMPORT, 1));

function header(command, sequence, status, length) {
  const bytes = Buffer.alloc(HEADER);
  bytes.writeUInt32BE(command, 0);
  bytes.writeUInt32BE(sequence, 4);
  bytes.writeInt32BE(status, 20);
  bytes.writeUInt32BE(length, 24);
  return bytes;
}

/** End of a transfer; `length` counts for OUT too, where no data follow. */
export const submitted = (sequence, status, length, data = Buffer.alloc(0)) => Buffer.concat([header(RET_SUBMIT, sequence, status, length), data]);
export const unlinked = (sequence, status) => header(RET_UNLINK, sequence, status, 0);

/** Takes one request off the begin of `bytes` before a device is imported: {code, busId, size}, or null if it is not all there. */
export function parseOperation(bytes) {
  if (bytes.length < REQUEST) return null;
  const code = bytes.readUInt16BE(2);
  if (code !== OP_REQ_IMPORT) return { code, size: REQUEST };
  if (bytes.length < IMPORT_REQUEST) return null;
  return { code, busId: bytes.toString('latin1', 8, 40).replace(/\0.*$/s, ''), size: IMPORT_REQUEST };
}

/** One command after the import, or null if it is not all there. */
export function parseCommand(bytes) {
  if (bytes.length < HEADER) return null;
  const [command, sequence, , direction, endpoint] = [0, 4, 8, 12, 16].map((at) => bytes.readUInt32BE(at));
  if (command === CMD_UNLINK) return { command, sequence, target: bytes.readUInt32BE(20), size: HEADER };
  const length = bytes.readUInt32BE(24);
  const size = HEADER + (direction === 0 ? length : 0);
  if (bytes.length < size) return null;
  return {
    command, sequence, endpoint, length, size,
    reads: direction === 1,
    flags: bytes.readUInt32BE(20),
    setup: Buffer.from(bytes.subarray(40, 48)),
    data: Buffer.from(bytes.subarray(HEADER, size)),
  };
}
