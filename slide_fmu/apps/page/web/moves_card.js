// The card of moves: how far each is from rest, and when it stands still.

import { widenedLog } from "../../../core/web/modules/axes.js";
import { element } from "../../../core/web/modules/elements.js";
import { drawPlot } from "../../../core/web/modules/plot.js";
import { quantity } from "../../../core/web/modules/units.js";

const LOOKS = [
  { colour: "line", width: 2.2 },
  { colour: "truth", width: 2, dashed: true },
];
const SWATCHES = ["line", "truth"];

// distances are drawn down to this part of the tolerance
const SMALLEST = 0.1;

/** A MovesCard shows the distances of moves from rest over time. */
export class MovesCard {
  constructor(moves, block) {
    this.moves = moves;
    this.words = element("p", { class: "verdict", role: "status" });
    this.canvas = element("canvas", { class: "plot main", role: "img", "aria-label": "distance from rest" });
    const keys = moves.courses.map(({ name }, i) =>
      element("span", { class: "key" }, element("i", { class: `swatch ${SWATCHES[i]}` }), name),
    );
    const tolerance = element("span", { class: "key" }, element("i", { class: "swatch good" }), "tolerance");
    block.append(element("h3", {}, "distance from rest"), this.words, this.canvas);
    block.append(element("p", { class: "keys" }, ...keys, tolerance));
  }

  /** Says when each move stands still. */
  say() {
    const { moves } = this;
    const within = quantity(moves.tolerance, moves.tolerance, moves.unit, 2);
    const times = moves.courses.map((_, i) => moves.settled(i));
    const parts = moves.courses.map(({ name }, i) => 
      Number.isFinite(times[i]) ? `${name} after ${times[i].toFixed(2)} s` : `${name} not yet`,
    );
    const earlier = Math.round(100 * (1 - times[0] / times[1]));
    const order = earlier > 0 ? "earlier" : "later";
    const gain = Number.isFinite(earlier) && earlier !== 0 ? ` That is ${Math.abs(earlier)} % ${order}.` : "";
    this.words.textContent = `It stands still, within ${within}: ${parts.join(", ")}.${gain}`;
  }

  draw(at) {
    const { moves } = this;
    const least = SMALLEST * moves.tolerance;
    const lines = moves.distances.map((values, i) => ({
      values: values.map((value) => Math.max(value, least)),
      ...LOOKS[i],
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
