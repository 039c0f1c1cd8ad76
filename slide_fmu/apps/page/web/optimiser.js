// Optimise: the best move to a goal that people choose is searched here, while the page goes on.

import { distanceOf } from "./channels.js";
import { saveText } from "../../../core/web/modules/blobs.js";
import { byId } from "../../../core/web/modules/elements.js";
import { digits, quantity, scaleFor } from "../../../core/web/modules/units.js";
import { Moves } from "./moves.js";
import { marginOf, Rehearsal } from "./rehearsal.js";
import { search } from "./search.js";
import { taskText } from "./task_text.js";

const SLICE = 10; // of the search in a frame, in ms
const AFTER = 0.4; // that is shown after the last move has come to rest, in s

// of the range of the outputs, where nothing else is said
const TOLERANCE = 2e-3;

/** An Optimiser searches moves of an app; limits: of each channel, or null where it may jump. */
export class Optimiser {
  constructor(app, limits) {
    const { facts, channels } = app;
    const [{ unit, low, high }] = facts.outputs;
    Object.assign(this, { app, facts, channels });
    this.possible = facts.outputs.every((output) => output.unit === unit);
    this.limits = facts.moves?.limits.map((own, i) => own ?? limits[i]) ?? limits;
    this.tolerance = facts.moves?.tolerance ?? Number((TOLERANCE * (high - low)).toPrecision(1));
    this.scale = scaleFor(this.tolerance, unit);
    const [carried] = app.moves?.courses ?? [];
    const at = (row, i) => (row === undefined ? channels[i].start : channels[i].read(row));
    this.start = channels.map((_, i) => at(carried?.rows[0], i));
    this.goal = carried === undefined ? null : channels.map((_, i) => at(carried.rows.at(-1), i));
    this.open = false; // is there a goal without moves to it?
    byId("tolerance").value = digits(this.tolerance / this.scale.factor, 2);
    byId("tolerance-unit").textContent = this.scale.unit;
    byId("optimise").addEventListener("click", () => app.attempt(() => this.begin()));
    byId("start-here").addEventListener("click", () => this.startHere());
    byId("save-task").addEventListener("click", () => this.save());
    byId("tolerance").addEventListener("change", () => {
      this.tolerance = Number(byId("tolerance").value) * this.scale.factor;
      this.chooseGoal();
    });
    this.sayStart();
  }

  /** Comes to the way "moves", or leaves it. */
  enter(way) {
    this.stop();
    if (way !== "moves") {
      return;
    }
    const { app } = this;
    app.wander(false);
    if (this.goal === null) {
      this.goal = app.live.targets.every((value, i) => value === this.start[i]) ? this.example() : [...app.live.targets];
    }
    app.live.targets = [...this.goal];
    app.panel.show(this.goal);
    if (app.moves === null) {
      this.open = true;
      app.attempt(() => this.begin());
    } else if (!this.open) {
      app.player.go(app.moves.xRange[0]);
    }
  }

  /** A goal where people chose none: the two inputs of the pad move by a fifth of their ranges. */
  example() {
    const { axes } = this.app.panel.pad;
    return this.start.map((value, i) => {
      const { low, high } = this.channels[i];
      const size = axes.includes(i) ? 0.2 * (high - low) : 0;
      return value + size > high ? value - size : value + size;
    });
  }

  /** People choose a goal, or what counts as standing still. */
  chooseGoal() {
    if (this.app.way === "moves") {
      this.stop();
      this.goal = [...this.app.live.targets];
      this.open = true;
      this.app.wish();
    }
  }

  startHere() {
    this.start = [...(this.goal ?? this.app.live.targets)];
    this.sayStart();
    this.chooseGoal();
  }

  sayStart() {
    const parts = this.channels.map(({ unit }, i) => `${digits(this.start[i])} ${unit === "1" ? "" : unit}`.trim());
    byId("start-pose").textContent = parts.join(", ");
  }

  rowOf(values) {
    const row = this.facts.inputs.map((input) => input.start);
    this.channels.forEach((channel, i) => channel.write(values[i], row));
    return row;
  }

  get goalRow() {
    return this.rowOf(this.goal);
  }

  get task() {
    const { start, goal, channels, tolerance, limits } = this;
    const { parameters, confidence } = this.app;
    const ways = channels.map((channel, i) => distanceOf(channel, start[i], goal[i]));
    return { channels, start, ways, tolerance, limits, parameters, confidence, step: this.facts.step };
  }

  begin() {
    const { task } = this;
    if (task.ways.every((way) => way === 0) || !(task.tolerance > 0)) {
      throw new Error("the goal is the start, or the tolerance is not above 0: choose another goal with the sliders");
    }
    this.open = true;
    this.rehearsal = new Rehearsal(this.app.session, this.facts, task);
    const margin = marginOf(this.rehearsal.rest, this.facts);
    if (margin > task.tolerance) {
      const size = quantity(margin, margin, this.facts.outputs[0].unit, 2);
      throw new Error(`at rest at the goal, predictions may be off by ${size}, more than the tolerance: choose a larger one, or another goal`);
    }
    this.searching = search(this.rehearsal, task);
    byId("search-line").hidden = false;
  }

  stop() {
    this.searching = null;
    byId("search-line").hidden = true;
  }

  /** Goes on with the search for a part of a frame. */
  goOn() {
    const end = performance.now() + SLICE;
    while (performance.now() < end) {
      const { done, value } = this.searching.next();
      if (done) {
        this.stop();
        this.finish(value);
        return;
      }
      byId("search").value = value;
    }
  }

  /** Shows the moves that were found; those that never surely stand still are left out, but not the plain one. */
  finish({ slower, found }) {
    const { rehearsal, facts, tolerance } = this;
    const [best, shaped, plain] = found;
    if (!Number.isFinite(best.settled)) {
      throw new Error("no move that the surrogate knows surely stands still within the tolerance: choose a larger one, or another goal");
    }
    const shown = [best, shaped, plain].filter(({ settled }, i) => i === 2 || Number.isFinite(settled));
    const times = shown.map(({ settled }) => settled).filter(Number.isFinite);
    const count = Math.ceil((Math.max(...times) + AFTER) / facts.step) + 1;
    const time = Array.from({ length: count }, (_, k) => rehearsal.begin + k * facts.step);
    const moves = shown.map(({ name, move }) => rehearsal.written(name, move, count));
    this.open = false;
    this.app.showMoves(new Moves(facts, { time, tolerance, moves, slower }));
  }

  save() {
    saveText("task.toml", taskText(this.facts, this.task));
  }
}
