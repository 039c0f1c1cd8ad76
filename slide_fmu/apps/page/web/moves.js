// Moves from rest to rest that the page carries: a chosen one, and one that it is better than.

import { Course } from "./course.js";

/** Moves are answered by the surrogate, all over the same times. */
export class Moves {
  constructor(facts) {
    const { time, tolerance, moves } = facts.moves;
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
  }

  /** The time from which a move stands still, within the tolerance, at its goal; NaN if never. */
  settled(index) {
    const late = this.distances[index].findLastIndex((distance) => distance > this.tolerance);
    return Math.max(this.time[late + 1] ?? NaN, this.arrivals[index]);
  }
}
