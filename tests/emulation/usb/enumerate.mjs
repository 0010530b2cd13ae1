// SPDX-License-Identifier: Apache-2.0
// What a host asks a new device, in the order Linux asks it: 8 bytes of the device descriptor, a second bus reset left out,
// address, descriptors, strings, BOS, configuration.

import { CYCLES_PER_MILLISECOND } from '../clock/constants.mjs';
import { parseConfiguration, parseDevice, parseString } from './descriptors.mjs';

const GET_DESCRIPTOR = 6;
const DEVICE = 1;
const CONFIGURATION = 2;
const STRING = 3;
const BOS = 15;
const ENGLISH = 0x0409;
const ADDRESS = 5;

export function descriptorRequest(type, index, language, length) {
  return [0x80, GET_DESCRIPTOR, index, type, language & 255, language >> 8, length & 255, length >> 8];
}

/** A step of a script that must succeed. */
function* ask(host, setup) {
  const result = yield (done) => host.submitControl(setup, null, done);
  if (result.status !== 'ok') throw new Error(`${Buffer.from(setup).toString('hex')}: ${result.status}`);
  return result.data;
}

function* readStrings(host, indices) {
  const strings = [];
  for (const index of indices) {
    strings.push(index ? parseString(yield* ask(host, descriptorRequest(STRING, index, ENGLISH, 255))) : '');
  }
  return strings;
}

/** Binary object store of a device that says it is USB 2.1; null for an older one. */
function* readObjectStore(host, usb) {
  if (usb < 0x0201) return null;
  const head = yield* ask(host, descriptorRequest(BOS, 0, 0, 5));
  return yield* ask(host, descriptorRequest(BOS, 0, 0, head.readUInt16LE(2)));
}

function* configure(host, configuration) {
  for (const { endpoints } of configuration.interfaces) {
    for (const { address, packetSize } of endpoints) host.transfers.sizes.set(address, packetSize);
  }
  yield* ask(host, [0, 9, configuration.value, 0, 0, 0, 0, 0]);
}

function* conversation(host) {
  const first = yield* ask(host, descriptorRequest(DEVICE, 0, 0, 64));
  if (first.length >= 8) for (const key of [0, 0x80]) host.transfers.sizes.set(key, first[7]);
  yield* ask(host, [0, 5, ADDRESS, 0, 0, 0, 0, 0]);
  yield host.pause(2 * CYCLES_PER_MILLISECOND);
  const device = parseDevice(yield* ask(host, descriptorRequest(DEVICE, 0, 0, 18)));
  const head = yield* ask(host, descriptorRequest(CONFIGURATION, 0, 0, 9));
  const configuration = parseConfiguration(yield* ask(host, descriptorRequest(CONFIGURATION, 0, 0, head.readUInt16LE(2))));
  const [manufacturerName, productName, serial] = yield* readStrings(host, device.strings);
  const bos = yield* readObjectStore(host, device.usb);
  yield* configure(host, configuration);
  return { ...device, configuration, manufacturerName, productName, serial, bos };
}

/** The enumerated device, or null; `host.failure` then says why. */
export function* enumerate(host) {
  try {
    return yield* conversation(host);
  } catch (error) {
    host.failure = `enumeration failed: ${error.message}`;
    return null;
  }
}
