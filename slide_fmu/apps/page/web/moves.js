// Moves from rest to rest: the best one first, then those that it is better than, the plain one last.

import { Course } from "./course.js";
import { isKnown, marginOf } from "./rehearsal.js";

/** Moves are answered by the surrogate, all over the same times. */
export class Moves {
  constructor(facts, { time, tolerance, moves, slower = 1 }) {
    this.slower = slower; // factor on the shortest time, since faster moves are not known
    this.tolerance = tolerance;
    this.unit = facts.outputs[0].unit;
    this.courses = moves.map(
      ({ name, inputs }) =>
        new Course({ name, time, inputs, references: facts.outputs.map(() => null), parameters: null }),
    );
    this.arrivals = moves.map((move) => move.arrives);
  }

  get time() {
    return this.courses[0].time;
  }

  get xRange() {
    return this.courses[0].xRange;
  }

  /** Lets the surrogate answer all of them. */
  run(session, facts, parameters, confidence) {
    const goal = this.courses[0].rows.at(-1);
    session.known = true; // a move is planned
    session.restart(goal, parameters, confidence);
    this.rest = session.step(goal, facts.step).outputs;
    this.courses.forEach((course) => course.run(session, facts, parameters, confidence));
    this.distances = this.courses.map((course) =>
      course.answers.map(({ outputs }) => Math.hypot(...outputs.map((y, i) => y - this.rest[i]))),
    );
    session.known = false;
    this.margins = this.courses.map((course) => course.answers.map((answer) => marginOf(answer, facts)));
    const [{ bounds, estimates, flags }] = this.courses[0].answers;
    const own = bounds.length > 0 ? "error bound" : estimates.length > 0 ? "error estimate" : null;
    this.kind = facts.usual === null ? own : "measured RMS error";
    this.confidence = bounds.length > 0 ? confidence : null;
    this.domain = flags.in_domain !== undefined;
    this.known = this.courses[0].answers.every((answer) => isKnown(answer.flags));
  }

  /** The largest margin after the first move. */
  get margin() {
    return Math.max(...this.margins[0].filter((_, k) => this.time[k] >= this.arrivals[0]));
  }

  /** Distances of a move from rest, with their margins. */
  away(index) {
    return this.distances[index].map((distance, k) => distance + this.margins[index][k]);
  }

  /** The time from which a move surely stands still, within the tolerance, at its goal; NaN if never. */
  settled(index) {
    const late = this.away(index).findLastIndex((distance) => distance > this.tolerance);
    return Math.max(this.time[late + 1] ?? NaN, this.arrivals[index]);
  }
}
