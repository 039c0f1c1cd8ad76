// Sliders: one for every value that people set.

import { element } from "../../../core/web/modules/elements.js";
import { digits } from "../../../core/web/modules/units.js";

/** A Slider shows and sets one value; `changed` is called with what people set. */
export class Slider {
  constructor({ name, unit, low, high, start, description }, changed) {
    const id = `slider-${name.replace(/\W+/g, "-")}`;
    this.unit = unit === "1" ? "" : unit;
    this.size = high - low;
    this.range = element("input", { type: "range", id, min: low, max: high, step: "any" });
    this.number = element("output", { for: id });
    this.range.addEventListener("input", () => {
      this.shown = Number(this.range.value);
      this.say();
      changed(Number(this.range.value));
    });
    this.range.addEventListener("keydown", (event) => this.press(event));
    this.range.addEventListener("dblclick", () => this.choose(start));
    const label = element("label", { for: id, title: description || name }, name);
    this.block = element("div", { class: "slider" }, label, this.number, this.range);
    this.show(start);
  }

  /** Shows a value that was set elsewhere. */
  show(value) {
    if (value !== this.shown) {
      this.shown = value;
      this.range.value = value;
      this.say();
    }
  }

  say() {
    const value = Number(this.range.value);
    const small = Math.abs(value) < 1e-6 * this.size ? 0 : value;
    const text = `${digits(small)} ${this.unit}`.trim();
    if (this.number.textContent !== text) {
      this.number.textContent = text;
      this.range.setAttribute("aria-valuetext", text);
    }
  }

  choose(value) {
    this.range.value = value;
    this.range.dispatchEvent(new Event("input"));
  }

  /** Keys move by a hundredth of the range, or by a tenth: browsers know no step of "any". */
  press(event) {
    const steps = {
      ...{ ArrowRight: 0.01, ArrowUp: 0.01, ArrowLeft: -0.01, ArrowDown: -0.01 },
      ...{ PageUp: 0.1, PageDown: -0.1 },
    };
    const part = steps[event.key];
    if (part !== undefined) {
      event.preventDefault();
      this.choose(Number(this.range.value) + part * this.size);
    }
  }
}
