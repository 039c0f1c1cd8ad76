// The card of moves: how far each is from rest, and when it stands still.

import { widenedLog } from "../../../core/web/modules/axes.js";
import { element } from "../../../core/web/modules/elements.js";
import { drawPlot } from "../../../core/web/modules/plot.js";
import { quantity } from "../../../core/web/modules/units.js";

const LOOKS = [
  { colour: "line", width: 2.2 },
  { colour: "estimate", width: 1.6 },
  { colour: "truth", width: 2, dashed: true },
];

// distances are drawn down to this part of the tolerance
const SMALLEST = 0.1;

/** How the moves look: the last one is the plain one. */
function looksOf(count) {
  return [...LOOKS.slice(0, count - 1), LOOKS.at(-1)];
}

/** A MovesCard shows the distances of moves from rest over time. */
export class MovesCard {
  constructor(block) {
    this.words = element("p", { class: "verdict", role: "status" });
    this.doubt = element("p", { class: "what" });
    this.canvas = element("canvas", { class: "plot main", role: "img", "aria-label": "distance from rest" });
    this.keys = element("p", { class: "keys" });
    block.append(element("h3", {}, "distance from rest"), this.words, this.doubt, this.canvas, this.keys);
  }

  /** Takes moves, and says when each stands still. */
  say(moves) {
    this.moves = moves;
    const looks = looksOf(moves.courses.length);
    const keys = moves.courses.map(({ name }, i) =>
      element("span", { class: "key" }, element("i", { class: `swatch ${looks[i].colour}` }), name),
    );
    const tolerance = element("span", { class: "key" }, element("i", { class: "swatch good" }), "tolerance");
    this.keys.replaceChildren(...keys, tolerance);
    const within = quantity(moves.tolerance, moves.tolerance, moves.unit, 2);
    const times = moves.courses.map((_, i) => moves.settled(i));
    const parts = moves.courses.map(({ name }, i) =>
      Number.isFinite(times[i]) ? `${name} after ${times[i].toFixed(2)} s` : `${name} not yet`,
    );
    const gain = gainOf(moves.courses.map(({ name }) => name), times);
    this.words.textContent = `It stands still, within ${within}: ${parts.join(", ")}.${gain}`;
    this.doubt.textContent = doubtOf(moves);
  }

  draw(at) {
    const { moves } = this;
    const looks = looksOf(moves.courses.length);
    const least = SMALLEST * moves.tolerance;
    const lines = moves.distances.map((values, i) => ({
      values: values.map((value) => Math.max(value, least)),
      ...looks[i],
    }));
    const level = { values: moves.time.map(() => moves.tolerance), colour: "good", width: 1.2 };
    const largest = Math.max(...moves.distances.flat());
    drawPlot(this.canvas, {
      xs: moves.time,
      xRange: moves.xRange,
      yRange: widenedLog([least, largest]),
      yLog: true,
      unit: moves.unit,
      lines: [level, ...lines.reverse()],
      cursor: moves.time[at],
      shade: null,
    });
  }
}

/** By how much the first move stands still earlier, or later, than each of the others. */
function gainOf(names, times) {
  const parts = times.slice(1).flatMap((time, i) => {
    const earlier = Math.round(100 * (1 - times[0] / time));
    if (!Number.isFinite(earlier) || earlier === 0) {
      return [];
    }
    const than = times.length > 2 ? ` than the ${names[i + 1]}` : "";
    return [`${Math.abs(earlier)} % ${earlier > 0 ? "earlier" : "later"}${than}`];
  });
  return parts.length === 0 ? "" : ` That is ${parts.join(", ")}.`;
}

/** How far the prediction of the first move may be off. */
function doubtOf({ margin, known, unit, tolerance }) {
  const parts = [];
  if (margin !== null) {
    const than = margin.size > tolerance ? ", larger than the tolerance: check it with the model" : "";
    parts.push(`After the first move the ${margin.of} is at most ${quantity(margin.size, margin.size, unit, 2)}${than}.`);
  }
  if (!known) {
    parts.push("The first move leaves what the surrogate knows: do not rely on it.");
  }
  return parts.join(" ");
}
