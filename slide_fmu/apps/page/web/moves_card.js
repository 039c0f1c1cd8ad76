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
    const names = moves.courses.map(({ name }) => name);
    const keys = names.map((name, i) =>
      element("span", { class: "key" }, element("i", { class: `swatch ${looks[i].colour}` }), name),
    );
    const tolerance = element("span", { class: "key" }, element("i", { class: "swatch good" }), "tolerance");
    const margin = element("span", { class: "key" }, element("i", { class: "swatch band" }), "with its margin");
    keys.splice(1, 0, ...(moves.kind === null ? [] : [margin]));
    this.keys.replaceChildren(...keys, tolerance);
    const within = quantity(moves.tolerance, moves.tolerance, moves.unit, 2);
    const times = moves.courses.map((_, i) => moves.settled(i));
    const parts = names.map((name, i) =>
      Number.isFinite(times[i]) ? `${name} after ${times[i].toFixed(2)} s` : `${name} not yet`,
    );
    const gain = gainOf(names, times);
    const sure = moves.kind === null ? "" : ", margin included";
    this.words.textContent = `It stands still, within ${within}${sure}: ${parts.join(", ")}.${gain}`;
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
    const sure = moves.away(0).map((value) => Math.max(value, least));
    const bands = moves.kind === null ? [] : [{ low: sure.map(() => least), high: sure, colour: "band" }];
    const level = { values: moves.time.map(() => moves.tolerance), colour: "good", width: 1.2 };
    const largest = Math.max(...sure, ...moves.distances.flat());
    drawPlot(this.canvas, {
      xs: moves.time,
      xRange: moves.xRange,
      yRange: widenedLog([least, largest]),
      yLog: true,
      unit: moves.unit,
      lines: [level, ...lines.reverse()],
      bands,
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

/** What the times count as the margin, and where it does not hold. */
function doubtOf({ margin, kind, confidence, domain, known, slower, unit }) {
  const size = quantity(margin, margin, unit, 2);
  const is = kind === "error bound" ? `error bound of ${Math.round(100 * confidence)} %` : `double ${kind}`;
  const parts = [
    kind === null
      ? "The times are predictions alone: the surrogate has no error estimate."
      : `The margin is the ${is}: after the first move at most ${size}.`,
  ];
  if (!known) {
    const left = domain ? "leaves what the surrogate knows" : "leaves the ranges of the inputs";
    parts.push(`The first move ${left}: do not rely on it.`);
  }
  if (slower > 1) {
    parts.push(`Moves as fast as allowed leave what the surrogate knows: all begin with ${slower} times the shortest time.`);
  }
  return parts.join(" ");
}
