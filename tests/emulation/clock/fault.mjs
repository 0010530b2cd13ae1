// SPDX-License-Identifier: Apache-2.0
// What the emulated chip cannot go on from: silicon would hang, fault or do something that is not modelled.

export class EmulationFault extends Error {
  constructor(what, { cycle, pc }) {
    super(`${what} (cycle ${cycle}, pc 0x${pc.toString(16)})`);
    this.name = 'EmulationFault';
    this.cycle = cycle;
    this.pc = pc;
  }
}
