// SPDX-License-Identifier: Apache-2.0
// A conversation with a device, written down as a generator: it yields functions that take a callback, and goes on with what
// that is called with. It runs from within the emulation, without promises, so that its order is the same in every run.

export function runScript(generator, done = () => {}) {
  const resume = (value) => {
    const { value: task, done: finished } = generator.next(value);
    if (finished) done(task);
    else task(resume);
  };
  resume();
}
