// SPDX-License-Identifier: Apache-2.0
// Reads descriptors (USB 2.0, 9.6).

export function parseDevice(bytes) {
  return {
    bytes,
    vendor: bytes.readUInt16LE(8),
    product: bytes.readUInt16LE(10),
    version: bytes.readUInt16LE(12),
    usb: bytes.readUInt16LE(2),
    class: [bytes[4], bytes[5], bytes[6]],
    packetSize: bytes[7],
    strings: [bytes[14], bytes[15], bytes[16]],
    configurations: bytes[17],
  };
}

/** Walks a chain of descriptors; stops with an error at one of impossible length. */
export function* walk(bytes) {
  for (let at = 0; at < bytes.length; at += bytes[at]) {
    if (bytes[at] < 2 || at + bytes[at] > bytes.length) throw new Error(`descriptor at ${at}: length ${bytes[at]} is impossible`);
    yield bytes.subarray(at, at + bytes[at]);
  }
}

/** {value, interfaces: [{number, class, endpoints: [{address, type, packetSize, interval}]}]} */
export function parseConfiguration(bytes) {
  if (bytes.length !== bytes.readUInt16LE(2)) throw new Error(`configuration says ${bytes.readUInt16LE(2)} bytes, has ${bytes.length}`);
  const interfaces = [];
  for (const part of walk(bytes)) {
    if (part[1] === 4) interfaces.push({ number: part[2], class: [part[5], part[6], part[7]], declared: part[4], endpoints: [] });
    if (part[1] !== 5) continue;
    interfaces.at(-1).endpoints.push({ address: part[2], type: part[3] & 3, packetSize: part.readUInt16LE(4), interval: part[6] });
  }
  for (const each of interfaces) {
    if (each.declared !== each.endpoints.length) throw new Error(`interface ${each.number} declares ${each.declared} endpoints, has ${each.endpoints.length}`);
  }
  return { bytes, value: bytes[5], interfaces };
}

export const parseString = (bytes) => bytes.subarray(2).toString('utf16le');
