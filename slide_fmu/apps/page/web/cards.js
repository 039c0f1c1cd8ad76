// A card for every output: its value now, its course, and what its error may be.

import { element, write } from "../../../core/web/modules/elements.js";
import { rangeOf, widened } from "../../../core/web/modules/axes.js";
import { drawPlot, placeAt } from "../../../core/web/modules/plot.js";
import { quantity } from "../../../core/web/modules/units.js";

function key(name, text) {
  return element("span", { class: "key" }, element("i", { class: `swatch ${name}` }), text);
}

/** A Card shows one output. */
export class Card {
  constructor(output, index, facts) {
    this.output = output;
    this.index = index;
    this.value = element("strong", { class: "value" });
    this.error = element("p", { class: "error" });
    this.main = element("canvas", { class: "plot main", role: "img" });
    this.below = element("canvas", { class: "plot below", role: "img" });
    this.keys = element("p", { class: "keys" });
    this.estimated = facts.estimated;
    const heading = element("h3", {}, output.name);
    const what = element("p", { class: "what" }, output.description);
    const head = element("div", { class: "head" }, heading, this.value);
    this.block = element("article", { class: "card" }, head, what, this.error);
    this.block.append(this.main, this.keys, this.below);
  }

  /** Calls back with the time that people point at, or null. */
  onPoint(callback) {
    for (const canvas of [this.main, this.below]) {
      const point = (event) => callback(placeAt(canvas, event.clientX, this.xRange));
      canvas.addEventListener("pointermove", point);
      canvas.addEventListener("pointerdown", point);
      canvas.addEventListener("pointerleave", () => callback(null));
    }
  }

  /**
   * Draws a run: { live, time, answers, references, xRange, at, confidence, cursor }.
   *
   * references: columns that belong to the outputs, NaN where nothing is known, or null each; at:
   * the index of the answer whose values are shown; cursor: whether it is marked.
   */
  draw(run) {
    const { time, answers, xRange } = run;
    const i = this.index;
    const { estimate, bound, unit } = this.output;
    const values = answers.map((answer) => answer.outputs[i]);
    const estimates = estimate === null ? null : answers.map((answer) => answer.estimates[i]);
    const bounds = bound === null ? null : answers.map((answer) => answer.bounds[i]);
    const reference = run.references?.[i] ?? null;
    const errors = reference === null ? null : values.map((v, k) => Math.abs(v - reference[k]));
    const cursor = run.cursor ? time[run.at] : null;
    const known = answers.findIndex((answer) => answer.flags.window_filled === 1);
    const shade = known === 0 ? null : time.at(known);
    const common = { xs: time, xRange, unit, cursor, shade, known: Math.max(known, 0) };
    this.kept = run.live ? this.kept : undefined;
    this.xRange = xRange;
    this.drawCourse(common, values, bounds ?? estimates, reference);
    this.drawErrors(common, estimates, bounds, errors);
    this.say(run.at, values, estimates, bounds, errors);
    this.explain(run.confidence, estimates, bounds, reference, shade);
  }

  drawCourse(common, values, band, reference) {
    const { low, high } = this.output;
    const known = values.slice(common.known);
    const seen = rangeOf([known, ...(reference === null ? [] : [reference])]);
    const lines = [{ values, colour: "line" }];
    if (reference !== null) {
      lines.unshift({ values: reference, colour: "truth", width: 3, dashed: true });
    }
    const bands =
      band === null
        ? []
        : [
            {
              low: values.map((value, k) => value - band[k]),
              high: values.map((value, k) => value + band[k]),
              colour: "band",
            },
          ];
    const yRange = steady(this.kept, widened(seen, 0.04 * (high - low)));
    this.kept = yRange;
    const size = Math.max(Math.abs(low), Math.abs(high));
    drawPlot(this.main, { ...common, size, yRange, lines, bands });
  }

  drawErrors(common, estimates, bounds, errors) {
    const all = [estimates, bounds, errors].filter((values) => values !== null);
    this.below.hidden = all.length === 0;
    if (all.length === 0) {
      return;
    }
    const lines = [];
    if (errors !== null) {
      lines.push({ values: errors, colour: "truth", dashed: true, width: 1.4 });
    }
    if (estimates !== null) {
      lines.push({ values: estimates, colour: "estimate", width: 2 });
    }
    const bands = bounds === null ? [] : [{ low: bounds.map(() => 0), high: bounds, colour: "band" }];
    const seen = all.map((column) => column.slice(common.known));
    const top = Math.max(rangeOf(seen)[1], 1e-9 * (this.output.high - this.output.low));
    drawPlot(this.below, { ...common, yRange: [0, 1.1 * top], lines, bands });
  }

  say(at, values, estimates, bounds, errors) {
    const { unit, low, high } = this.output;
    const largest = Math.max(Math.abs(low), Math.abs(high));
    const value = quantity(values[at], largest, unit, 4);
    write(this.value, value);
    const parts = [];
    const add = (text, list) => {
      if (list !== null && Number.isFinite(list[at])) {
        parts.push(`${text} ${quantity(list[at], list[at], unit, 2)}`);
      }
    };
    add("bound", bounds);
    add("estimate", estimates);
    add("true error", errors);
    write(this.error, parts.join(" · "));
    this.main.setAttribute("aria-label", `${this.output.name}: ${value}`);
    this.below.setAttribute("aria-label", `errors of ${this.output.name}: ${parts.join(", ")}`);
  }

  /** The key of the lines; written anew only when it changes. */
  explain(confidence, estimates, bounds, reference, shade) {
    const found = [key("line", "surrogate")];
    if (reference !== null) {
      found.push(key("truth", "reference, and the true error below"));
    }
    if (bounds !== null) {
      found.push(key("band", `error bound, ${Math.round(100 * confidence)} %`));
    }
    if (estimates !== null) {
      const span = `${Number(this.estimated.toPrecision(2))} s`;
      found.push(key("estimate", `error estimate, RMS of the last ${span}`));
    }
    if (shade !== null) {
      found.push(key("shade", "past not known"));
    }
    const text = found.map((item) => item.textContent).join();
    if (this.keys.dataset.text !== text) {
      this.keys.dataset.text = text;
      this.keys.replaceChildren(...found);
    }
  }
}

/** A range that grows at once and shrinks slowly, so that the eye can follow. */
function steady(before, wanted) {
  if (before === undefined) {
    return wanted;
  }
  const slow = (old, now) => old + 0.03 * (now - old);
  return [
    wanted[0] < before[0] ? wanted[0] : slow(before[0], wanted[0]),
    wanted[1] > before[1] ? wanted[1] : slow(before[1], wanted[1]),
  ];
}
