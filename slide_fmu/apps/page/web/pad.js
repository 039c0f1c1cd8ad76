// A pad: one or two inputs follow the pointer, or an angle does.

import { element } from "../../../core/web/modules/elements.js";

/** A Pad sets channels by where it is touched; `changed(index, value)` is called with them. */
export class Pad {
  constructor(channels, changed) {
    this.channels = channels;
    this.changed = changed;
    this.dial = channels.length === 1 && channels[0].turns;
    this.flat = channels.length === 1 && !this.dial;
    this.axes = [0, Math.min(1, channels.length - 1)];
    const names = channels.map((channel) => channel.name).join(", ");
    this.knob = element("div", { class: "knob" });
    this.area = element("div", {
      class: `pad ${this.dial ? "dial" : ""} ${this.flat ? "flat" : ""}`,
      role: "application",
      tabindex: "0",
      "aria-label": `Pad for ${names}: drag, or use the arrow keys; double-click for the start`,
    });
    this.area.append(this.knob);
    this.area.addEventListener("pointerdown", (event) => this.drag(event));
    this.area.addEventListener("pointermove", (event) => event.buttons === 1 && this.drag(event));
    this.area.addEventListener("keydown", (event) => this.press(event));
    this.area.addEventListener("dblclick", () => this.toStart());
    this.block = element("div", { class: "pad-block" }, this.area);
    if (channels.length > 2) {
      this.block.append(this.choices());
    }
  }

  /** Which two inputs the pad sets. */
  choices() {
    const choice = (axis, text) => {
      const options = this.channels.map((channel, i) =>
        element("option", { value: i, selected: i === this.axes[axis] }, channel.name),
      );
      const select = element("select", {}, ...options);
      select.addEventListener("change", () => {
        this.axes[axis] = Number(select.value);
      });
      return element("label", {}, text, select);
    };
    return element("div", { class: "row" }, choice(0, "→ "), choice(1, "↑ "));
  }

  drag(event) {
    if (event.type === "pointerdown") {
      this.area.setPointerCapture(event.pointerId);
      this.area.focus({ preventScroll: true });
    }
    event.preventDefault();
    const box = this.area.getBoundingClientRect();
    const part = (at, begin, size) => Math.min(Math.max((at - begin) / size, 0), 1);
    const x = part(event.clientX, box.left, box.width);
    const y = 1 - part(event.clientY, box.top, box.height);
    if (this.dial) {
      this.set(0, (Math.atan2(y - 0.5, x - 0.5) * 180) / Math.PI);
      return;
    }
    this.setPart(this.axes[0], x);
    if (!this.flat) {
      this.setPart(this.axes[1], y);
    }
  }

  set(index, value) {
    this.changed(index, value);
  }

  setPart(index, part) {
    const { low, high } = this.channels[index];
    this.set(index, low + part * (high - low));
  }

  toStart() {
    new Set(this.axes).forEach((index) => this.set(index, this.channels[index].start));
  }

  press(event) {
    const ways = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1] };
    const way = ways[event.key];
    if (way !== undefined) {
      event.preventDefault();
      const index = this.axes[this.flat || this.dial ? 0 : way[0]];
      const { low, high, turns } = this.channels[index];
      const value = this.values[index] + way[1] * 0.02 * (high - low);
      const turned = value - 360 * Math.round(value / 360);
      this.set(index, turns ? turned : Math.min(Math.max(value, low), high));
    }
  }

  /** Shows where the channels are set to. */
  show(values) {
    this.values = values;
    const part = (index) => {
      const { low, high } = this.channels[index];
      return (values[index] - low) / (high - low);
    };
    let [x, y] = [part(this.axes[0]), this.flat ? 0.5 : part(this.axes[1])];
    if (this.dial) {
      const angle = (values[0] * Math.PI) / 180;
      [x, y] = [0.5 + 0.42 * Math.cos(angle), 0.5 + 0.42 * Math.sin(angle)];
    }
    this.knob.style.left = `${100 * Math.min(Math.max(x, 0), 1)}%`;
    this.knob.style.top = `${100 * (1 - Math.min(Math.max(y, 0), 1))}%`;
  }
}
