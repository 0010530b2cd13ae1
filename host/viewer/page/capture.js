// SPDX-License-Identifier: Apache-2.0
// A capture that runs: asks symrig how far it is, and shows that above the picture.
import { ask } from "./engine.js";
import { Planes } from "./light_code.js";
import { automatic_exposure, paint_picture } from "./tone.js";
import { paint_canvas } from "./stage.js";
import { element } from "./widgets.js";

const kEvery = 500; // ms between two questions
const kPatience = 5; // questions without an answer

const field = (id) => document.getElementById(id);
const pause = (time) => new Promise((resolve) => setTimeout(resolve, time));

/** "75 s", "12 min", "3.5 h" */
function time_text(seconds) {
  if (seconds < 120) return `${seconds < 10 ? seconds.toFixed(1) : Math.round(seconds)} s`;
  return seconds < 7200 ? `${Math.round(seconds / 60)} min` : `${(seconds / 3600).toFixed(1)} h`;
}

export class RunningCapture {
  /** facts: of the page. on_tensor(): there is a newer tensor. on_complete(): the capture has ended well. */
  constructor(facts, { on_tensor, on_complete }) {
    Object.assign(this, { facts, on_tensor, on_complete, tensor: 0, photograph: 0 });
  }

  /** Until the capture is complete, or symrig does not answer any more. */
  async watch() {
    field("capture").hidden = false;
    field("capture-details").open = window.innerWidth > 860; // on a phone the picture comes first
    for (let unanswered = 0; unanswered < kPatience; ) {
      try {
        if (await this.look()) return;
        unanswered = 0;
      } catch {
        ++unanswered;
      }
      await pause(kEvery);
    }
    this.tell_end("symrig does not answer. The capture was stopped or has failed: its terminal says more. This is the last state.");
  }

  /** Nothing more will come. */
  tell_end(text) {
    field("capture-stage").textContent = text;
    field("capture-bar").hidden = true;
    if (this.tensor === 0) field("facts").textContent = "There is no picture.";
  }

  /** Asks once. True if the capture has ended. */
  async look() {
    const now = JSON.parse(new TextDecoder().decode(await ask("live")));
    if (now.failed !== null) {
      this.show(now);
      this.tell_end(`The capture has ended without a scene: ${now.failed}`);
      return true;
    }
    if (now.complete) {
      field("capture").hidden = true;
      await this.on_complete();
      return true;
    }
    this.show(now);
    if (now.photograph > this.photograph) await this.show_last(now.photograph);
    if (now.tensor > this.tensor) {
      this.tensor = now.tensor;
      await this.on_tensor();
    }
    return false;
  }

  show(now) {
    const [done, expected] = now.computing ? [now.steps, now.stepsExpected] : [now.done, now.expected];
    const of = expected > 0 ? ` of ${expected}` : "";
    const unit = now.computing ? `steps, ${now.done} photographs` : "photographs";
    field("capture-stage").textContent = now.stage ? `Capturing: ${now.stage}, ${done}${of} ${unit}` : "The capture begins";
    const bar = field("capture-bar");
    if (expected > 0) [bar.max, bar.value] = [expected, done];
    else bar.removeAttribute("value");
    const to_go = now.toGo === null ? "time to go not known yet" : `about ${time_text(now.toGo)} to go`;
    field("capture-numbers").textContent = [
      `${now.frames} frames`,
      `${now.lostFrames} lost`,
      ...(now.computing ? [] : [`${now.steps} steps computed`]),
      `${time_text(now.rigSeconds)} of rig time`,
      `${time_text(now.seconds)} elapsed`,
      ...(now.failed === null ? [to_go] : []),
    ].join(" · ");
    field("capture-trouble").replaceChildren(...now.trouble.map((text) => element("li", { textContent: text })));
    this.show_levels(now.levels);
  }

  show_levels(levels) {
    field("capture-levels").hidden = levels.length === 0;
    const error = ({ error, halfWidth }) => (error === null ? "–" : `${(100 * error).toPrecision(3)} % ± ${(100 * (halfWidth ?? 0)).toPrecision(2)} %`);
    field("capture-levels").tBodies[0].replaceChildren(...levels.map((one) =>
      element("tr", {}, [one.level, one.photographs, error(one)].map((text) => element("td", { textContent: text })))));
  }

  /** The pattern, and its photograph with half a percent white. */
  async show_last(number) {
    const [rows, cols] = this.facts.camera;
    const planes = new Planes(await ask("last"));
    const pattern = planes.next(rows * cols), photograph = planes.all(rows * cols);
    this.photograph = number;
    const fill = (what, exposure) => (codes) => paint_picture(codes, what, exposure, "srgb", "grey");
    paint_canvas(field("last-pattern"), rows, cols, fill([pattern], 1));
    paint_canvas(field("last-photograph"), rows, cols, fill(photograph, automatic_exposure(photograph)));
    field("last-figure").hidden = field("last-photograph-figure").hidden = false;
  }
}
