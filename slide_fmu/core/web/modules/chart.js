// A chart: panels above each other that share their x axis, with zoom and values to read.

import { rangeOf, widened, widenedLog } from "./axes.js";
import { element } from "./elements.js";
import { drawPlot, placeAt } from "./plot.js";
import { Readout } from "./readout.js";
import { watchChart } from "./touch.js";

/** One panel of a chart, its columns looked up. */
class ChartPanel {
  constructor(description, columns) {
    const look = (trace) =>
      Object.fromEntries(
        Object.entries({ xs: "x", values: "y", low: "low", high: "high" })
          .filter(([, key]) => trace[key] !== undefined)
          .map(([name, key]) => [name, columns[trace[key]]]),
      );
    this.description = description;
    this.lines = description.lines.map((line) => ({ ...line, ...look(line) }));
    this.bands = description.bands.map((band) => ({ ...band, ...look(band) }));
    this.canvas = element("canvas", {
      class: `plot chart ${description.height}`,
      tabindex: "0",
      role: "img",
      "aria-label": `${description.title}: ${this.lines.map((line) => line.name).join(", ")}`,
    });
    this.readout = new Readout(description, this.lines, this.bands);
    this.block = element("div", { class: "panel" }, this.readout.block, this.canvas);
  }

  /** The range of x that all of it takes. */
  get xRange() {
    return rangeOf([...this.lines, ...this.bands].map((trace) => trace.xs));
  }

  /** The range of y that is seen between two places of x. */
  yRange([from, to]) {
    const { log, include } = this.description;
    const inside = ({ xs }, values) =>
      values.filter((value, k) => xs[k] >= from && xs[k] <= to && (!log || value > 0));
    const seen = rangeOf(
      [
        ...this.lines.map((line) => inside(line, line.values)),
        ...this.bands.flatMap((band) => [inside(band, band.low), inside(band, band.high)]),
      ],
      include,
    );
    return log ? widenedLog(seen) : widened(seen, 0);
  }

  draw({ xRange, cursor, selection, axis, parts, marks }) {
    this.readout.show(cursor);
    drawPlot(this.canvas, {
      xRange,
      yRange: this.yRange(xRange),
      xUnit: axis.unit,
      xLog: axis.log,
      unit: this.description.unit,
      yLog: this.description.log,
      lines: this.lines,
      bands: this.bands,
      marks,
      parts: [...parts, ...(selection === null ? [] : [selection])],
      cursor,
      shade: null,
    });
  }
}

/** A Chart shows a description whose columns are numbers of columns. */
export class Chart {
  constructor(description, columns) {
    this.axis = description.axis;
    this.parts = description.parts;
    this.marks = description.marks;
    this.panels = description.panels.map((panel) => new ChartPanel(panel, columns));
    const [low, high] = rangeOf(this.panels.map((panel) => panel.xRange));
    this.whole = this.axis.log ? [low, high] : widenedIfEmpty([low, high]);
    this.xRange = this.whole;
    this.cursor = null;
    this.selection = null;
    this.reset = element("button", { type: "button", class: "whole", hidden: true }, "Whole");
    this.reset.addEventListener("click", () => this.zoom(this.whole));
    this.block = element(
      "figure",
      { class: "card chart-card" },
      element("div", { class: "head" }, element("h3", {}, description.title), this.reset),
      ...(description.text === "" ? [] : [element("p", { class: "what" }, description.text)]),
      ...(description.shaded === "" || this.parts.length === 0 ? [] : [keyOfShade(description.shaded)]),
      ...this.panels.map((panel) => panel.block),
      element("figcaption", { class: "what axis" }, this.axis.label),
    );
    this.panels.forEach(({ canvas }) => watchChart(this, canvas));
    new ResizeObserver(() => this.draw()).observe(this.block);
  }

  /** The place of x under the pointer. */
  placeOf(canvas, clientX) {
    return placeAt(canvas, clientX, this.xRange, this.axis.log);
  }

  /** Marks a place, or none (null). */
  point(cursor) {
    this.cursor = cursor;
    this.draw();
  }

  /** Marks the part between two places, or none (null). */
  select(selection) {
    this.selection = selection;
    this.draw();
  }

  /** Shows the part between two places, within the whole. */
  zoom([from, to]) {
    const [low, high] = [Math.max(from, this.whole[0]), Math.min(to, this.whole[1])];
    const map = this.axis.log ? Math.log : (value) => value;
    if (map(high) - map(low) > 1e-4 * (map(this.whole[1]) - map(this.whole[0]))) {
      this.xRange = [low, high];
    }
    this.reset.hidden = this.xRange[0] === this.whole[0] && this.xRange[1] === this.whole[1];
    this.draw();
  }

  /** Makes what is seen so many times as long, about a place. */
  stretch(factor, about) {
    const { log } = this.axis;
    const map = log ? Math.log : (value) => value;
    const back = log ? Math.exp : (value) => value;
    this.zoom(this.xRange.map((end) => back(map(about) + factor * (map(end) - map(about)))));
  }

  draw() {
    if (this.block.clientWidth > 0) {
      this.panels.forEach((panel) => panel.draw(this));
    }
  }
}

/** Says what the shaded parts of all panels are. */
function keyOfShade(words) {
  const swatch = element("i", { class: "swatch shade" });
  return element("p", { class: "keys" }, element("span", { class: "key" }, swatch, words));
}

function widenedIfEmpty([low, high]) {
  return high > low ? [low, high] : widened([low, high], 1);
}
