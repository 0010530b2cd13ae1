// SPDX-License-Identifier: Apache-2.0
// Seeded numbers (xorshift32): the same on every machine.

export function randomSource(seed) {
  let state = seed >>> 0 || 1;
  const next = () => {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    return state >>> 0;
  };
  const below = (limit) => next() % limit;
  return { next, below, bytes: (length) => Buffer.from(Array.from({ length }, () => below(256))) };
}
