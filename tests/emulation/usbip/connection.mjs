// SPDX-License-Identifier: Apache-2.0
// One client of the USB/IP server: lists and imports the device, then passes its transfers to the scripted host.

import {
  BUS_ID, CMD_SUBMIT, CMD_UNLINK, OP_REQ_DEVLIST, OP_REQ_IMPORT, STATUS, URB_ZERO_PACKET, deviceList, imported, parseCommand, parseOperation,
  submitted, unlinked,
} from './protocol.mjs';

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
