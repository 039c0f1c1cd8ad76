// The machine itself is gripped: the pointer on its drawing moves the two inputs of the pad.

import { byId, write } from "../../../core/web/modules/elements.js";

/** A Drag lets the pointer on a drawing set inputs: the canvas' width or height is a range. */
export class Drag {
  /** app: { way, choose, setTarget, channels, panel, live }. */
  constructor(canvas, app) {
    this.app = app;
    this.canvas = canvas;
    this.last = null;
    canvas.classList.add("gripped");
    const [first, second] = app.channels.map((channel) => channel.name);
    const moved = {
      1: `→ moves ${first}.`,
      2: `→ moves ${first}, ↑ moves ${second}.`,
    };
    const chosen = "→ and ↑ move the two inputs that are chosen for them.";
    write(byId("grip-text"), `Drag the machine: ${moved[app.channels.length] ?? chosen}`);
    canvas.addEventListener("pointerdown", (event) => this.begin(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const kind of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(kind, () => {
        this.last = null;
      });
    }
  }

  begin(event) {
    if (!["live", "moves"].includes(this.app.way)) {
      this.app.choose("live");
    }
    this.canvas.setPointerCapture(event.pointerId);
    this.last = [event.clientX, event.clientY];
  }

  move(event) {
    if (this.last === null) {
      return;
    }
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const parts = [(event.clientX - this.last[0]) / width, (this.last[1] - event.clientY) / height];
    this.last = [event.clientX, event.clientY];
    const axes = this.app.panel.pad.axes;
    [...new Set(axes)].forEach((index, k) => this.turn(index, parts[k]));
  }

  /** Moves an input by a part of its range; angles go on over a whole turn. */
  turn(index, part) {
    const { low, high, turns } = this.app.channels[index];
    const value = this.app.live.targets[index] + part * (high - low);
    const turned = value - 360 * Math.round(value / 360);
    this.app.setTarget(index, turns ? turned : Math.min(Math.max(value, low), high));
  }
}
