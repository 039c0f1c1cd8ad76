// What went in, as one plot: one input in its unit, or several, each over its range.

import { element } from "../../../core/web/modules/elements.js";
import { rangeOf, widened } from "../../../core/web/modules/axes.js";
import { drawPlot } from "../../../core/web/modules/plot.js";

const COLOURS = 6;

/** The plot of the inputs. */
export class InputsPlot {
  constructor(channels, block, hold) {
    this.held = hold === "zero_order"; // else inputs move from sample to sample
    this.channels = channels;
    this.canvas = element("canvas", { class: "plot main", role: "img", "aria-label": "inputs" });
    const keys = channels.map((channel, i) =>
      element("span", { class: "key" }, element("i", { class: `swatch input-${i % COLOURS}` }), channel.name),
    );
    const text = channels.length > 1 ? "each over half its range" : channels[0].description;
    block.append(element("h3", {}, "inputs"), element("p", { class: "what" }, text), this.canvas);
    if (channels.length > 1) {
      block.append(element("p", { class: "keys" }, ...keys));
    }
  }

  /** Draws { live, time, rows, xRange, at, cursor }. */
  draw(run) {
    // live, a row stands at the end of its step, in a record at the begin
    const stairs = run.live ? "steps" : "held";
    const style = this.held ? stairs : "line";
    const single = this.channels.length === 1;
    const lines = this.channels.map((channel, i) => {
      const middle = (channel.low + channel.high) / 2;
      const half = (channel.high - channel.low) / 2;
      const show = single ? (v) => v : (v) => (v - middle) / half;
      const values = run.rows.map((row) => show(channel.read(row)));
      return { values, colour: `input-${i % COLOURS}`, width: 1.3, style };
    });
    const { low, high, unit } = this.channels[0];
    drawPlot(this.canvas, {
      xs: run.time,
      xRange: run.xRange,
      yRange: widened(rangeOf(lines.map((line) => line.values), single ? [0.9 * low, 0.9 * high] : [-1, 1]), 0),
      unit: single ? unit : "1",
      lines,
      cursor: run.cursor ? run.time[run.at] : null,
      shade: null,
    });
  }
}
