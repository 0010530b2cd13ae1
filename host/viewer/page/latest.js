// SPDX-License-Identifier: Apache-2.0

/** Runs a job again and again, never two at once. Requests during a run become one further run, so nothing old waits in a queue. */
export class Latest {
  constructor(job) {
    this.job = job;
    this.wanted = false;
    this.running = null;
  }

  request() {
    this.wanted = true;
    this.running ??= this.run();
  }

  /** Resolves when nothing is wanted any more. */
  async idle() {
    while (this.running) await this.running;
  }

  async run() {
    await null; // all changes of one event belong to one run
    while (this.wanted) {
      this.wanted = false;
      await this.job();
    }
    this.running = null;
  }
}
