// What is shown of a run, live or of a record: cards, inputs, lamp, clock.

import { Card } from "./cards.js";
import { Drawing } from "./drawing.js";
import { keepCanvas } from "../../../core/web/modules/canvases.js";
import { byId, element, write } from "../../../core/web/modules/elements.js";
import { InputsPlot } from "./inputs.js";
import { watchLooks } from "./looks.js";
import { showLamp } from "./trust.js";

// before a move the machine rests, so that its past is known
const RESTED = { window_filled: 1, error_estimate_filled: 1, error_bound_filled: 1 };

/** The machine as the reference had it at the time that is shown; null where that is not known. */
function truthAt({ references, rows, at }) {
  const outputs = (references ?? [null]).map((column) => column?.[at] ?? NaN);
  return outputs.every(Number.isFinite) ? { row: rows[at], outputs } : null;
}

/** A View draws runs. */
export class View {
  /** wish: asks for a drawing of all. */
  constructor(facts, channels, { point, wish }, drawing) {
    this.facts = facts;
    this.cards = facts.outputs.map((output, i) => new Card(output, i, facts));
    this.cards.forEach((card) => card.block.classList.add("output"));
    byId("outputs").append(...this.cards.map((card) => card.block));
    byId("drawing").hidden = drawing === null;
    byId("drawing-text").textContent = drawing?.text ?? "";
    this.drawing = drawing === null ? null : new Drawing(drawing, facts, byId("drawing-canvas"));
    if (this.drawing !== null) {
      watchLooks(this.drawing, wish);
    }
    byId("outputs").classList.toggle("many", this.cards.length > 2);
    this.inputs = new InputsPlot(channels, byId("inputs-plot"), facts.hold);
    this.cards.forEach((card) => card.onPoint(point));
    document.querySelectorAll("canvas").forEach((canvas) => keepCanvas(canvas, wish));
    byId("plots").scrollTo(0, 0); // where they lie side by side, as on a phone
  }

  /** Shows nothing: there is no run. */
  clear() {
    byId("plots").hidden = true;
    byId("lamp").hidden = true;
    byId("clock").textContent = "";
  }

  /** Draws a run, as Card.draw wants it, with its rows of inputs; not whole: the machine alone. */
  draw(run, whole) {
    const { flags } = run.answers[run.at];
    this.drawing?.draw(run, run.parameters, truthAt(run));
    if (whole) {
      byId("plots").hidden = false;
      byId("lamp").hidden = false;
      this.cards.forEach((card) => card.draw(run));
      this.inputs.draw(run);
      showLamp(flags);
      write(byId("clock"), `${run.time[run.at].toFixed(2)} s`);
    }
  }

  drawLive(live, parameters, confidence, whole) {
    const { now, span, time, rows, answers } = live;
    const xRange = [Math.max(0, now - span), Math.max(span, now)];
    const at = time.length - 1;
    this.draw({ live: true, time, rows, answers, references: null, xRange, at, cursor: false, parameters, confidence }, whole);
  }

  drawCourse(player, confidence, whole) {
    const { course, at } = player;
    const { time, rows, answers, references, xRange, given: parameters } = course;
    this.draw({ live: false, time, rows, answers, references, xRange, at, cursor: true, parameters, confidence }, whole);
    if (whole) {
      byId("time").value = course.time[at];
    }
  }

  /** Draws moves at the same time of all: the machine of the plain one behind the first. */
  drawMoves(player, card, whole) {
    const { course: moves, at } = player;
    const [first, second] = [moves.courses[0], moves.courses.at(-1)];
    const { time, rows, answers, xRange, given } = first;
    const behind = { row: second.rows[at], outputs: second.answers[at].outputs };
    this.drawing?.draw({ time, rows, answers, at }, given, behind);
    if (whole) {
      byId("plots").hidden = false;
      byId("lamp").hidden = false;
      byId("time").value = moves.time[at];
      card.draw(at);
      this.inputs.draw({ live: false, time, rows, xRange, at, cursor: true });
      showLamp({ ...answers[at].flags, ...RESTED });
      write(byId("clock"), `${time[at].toFixed(2)} s`);
    }
  }

  /** Draws the machine at a row of inputs, as if it were rigid: a goal that is being chosen. */
  drawPose(row, parameters) {
    const outputs = this.facts.outputs.map(() => 0);
    this.drawing?.draw({ time: [0], rows: [row], answers: [{ outputs }], at: 0 }, parameters, null);
  }

  /** The table of errors beside a reference; difference: to what the FMU stores, or null. */
  showErrors(course, difference) {
    const rows = course.errors(this.facts).map(([name, text]) =>
      element("tr", {}, element("td", {}, name), element("td", {}, text)),
    );
    byId("record-name").textContent = course.name;
    byId("errors").replaceChildren(...rows);
    byId("errors-block").hidden = rows.length === 0;
    byId("same").textContent = difference === null ? "" : `${Number((100 * difference).toPrecision(2))} % of the range`;
  }
}
