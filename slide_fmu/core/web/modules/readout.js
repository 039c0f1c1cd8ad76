// The heading of a panel: what its lines are, and their values at the place that is marked.

import { element } from "./elements.js";
import { quantity } from "./units.js";

/** The index of the place that is nearest to one, among rising ones. */
function nearest(xs, place) {
  let [low, high] = [0, xs.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (xs[middle] > place) {
      high = middle;
    } else {
      low = middle;
    }
  }
  return Math.abs(xs[low] - place) <= Math.abs(xs[high] - place) ? low : high;
}

function rises(xs) {
  return xs.length > 0 && xs.every((x, k) => k === 0 || x >= xs[k - 1]);
}

/** A Readout names the lines and bands of a panel, each with its value where there is a mark. */
export class Readout {
  constructor({ title, unit }, lines, bands) {
    this.unit = unit;
    const named = [
      ...lines.map((line) => ({ ...line, kind: line.style === "points" ? "dots" : "" })),
      ...bands.map((band) => ({ ...band, values: band.high, kind: "block" })),
    ].filter(({ name }) => name !== "");
    this.keys = named.map((trace) => {
      const value = element("span", { class: "value" });
      const swatch = element("i", {
        class: `swatch ${trace.kind} ${trace.dashed ? "broken" : ""}`,
        style: `--paint: var(--${trace.colour})`,
      });
      const block = element("span", { class: "key" }, swatch, trace.name, value);
      return { ...trace, value, block, readable: rises(trace.xs) };
    });
    const heading = title === "" ? [] : [element("strong", {}, title)];
    this.block = element("p", { class: "keys" }, ...heading, ...this.keys.map((key) => key.block));
  }

  /** Says the values at a place of the x axis, or none (null). */
  show(place) {
    for (const { xs, values, value, readable } of this.keys) {
      const found = place === null || !readable ? null : values[nearest(xs, place)];
      value.textContent = found === null ? "" : quantity(found, Math.abs(found), this.unit, 3);
    }
  }
}
