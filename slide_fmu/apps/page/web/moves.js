// Moves from rest to rest: the best one first, then those that it is better than, the plain one last.

import { Course } from "./course.js";

// errors and the domain are read once in so many samples: large estimators take milliseconds
const READ = 4;

/** Moves are answered by the surrogate, all over the same times. */
export class Moves {
  constructor(facts, { time, tolerance, moves }) {
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
    this.courses.forEach((course) => course.run(session, facts, parameters, confidence, READ));
    this.distances = this.courses.map((course) =>
      course.answers.map(({ outputs }) => Math.hypot(...outputs.map((y, i) => y - this.rest[i]))),
    );
    session.known = false;
    this.margin = this.marginOf(this.courses[0], this.arrivals[0]);
    this.known = this.courses[0].answers.every(({ flags }) => (flags.in_domain ?? flags.inputs_in_range) === 1);
  }

  /** The largest error that is expected after a move: { size, of }, or null if none is known. */
  marginOf({ answers }, arrival) {
    const after = answers.filter((_, k) => this.time[k] >= arrival);
    const [{ bounds, estimates }] = answers;
    if (after.length === 0 || (bounds.length === 0 && estimates.length === 0)) {
      return null;
    }
    const bounded = bounds.length > 0;
    const sizes = after.map((answer) => Math.hypot(...(bounded ? answer.bounds : answer.estimates)));
    return { size: Math.max(...sizes), of: bounded ? "error bound" : "error estimate" };
  }

  /** The time from which a move stands still, within the tolerance, at its goal; NaN if never. */
  settled(index) {
    const late = this.distances[index].findLastIndex((distance) => distance > this.tolerance);
    return Math.max(this.time[late + 1] ?? NaN, this.arrivals[index]);
  }
}
