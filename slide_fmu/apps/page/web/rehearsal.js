// One move after another is tried with the surrogate: when does it stand still?

// it must stand still for so long, in s, to count while moves are compared
const LOOKED_ON = 0.5;

/** A Rehearsal tries moves from rest at a start to rest at a goal; both are rows of inputs. */
export class Rehearsal {
  /** task: { channels, start, goal: values of channels, ways, tolerance, parameters, confidence }. */
  constructor(session, facts, task) {
    Object.assign(this, { session, facts, task });
    this.step = facts.step;
    // a move is planned: inputs that move are set one step ahead
    this.begin = facts.hold === "first_order" ? -this.step : 0;
    session.known = true;
    const goal = this.row(1);
    session.begin(goal, task.parameters, task.confidence);
    this.rest = session.stepBriefly(goal, this.step);
    session.known = false;
  }

  /** Inputs after a share of the way. */
  row(share) {
    const { channels, start, ways } = this.task;
    const row = this.facts.inputs.map((input) => input.start);
    channels.forEach((channel, i) => channel.write(start[i] + share * ways[i], row));
    return row;
  }

  /** The share of the way at sample k of a move, { profile, time, impulses: [delay, part] }. */
  static share({ profile, time, impulses }, moment) {
    return impulses.reduce(
      (sum, [delay, part]) => sum + part * profile.way(Math.max(moment - delay, 0) / time),
      0,
    );
  }

  /** The first sample at which a move has come to its goal, and the time then. */
  arrival({ time, impulses }) {
    const done = time + impulses.at(-1)[0];
    const sample = Math.ceil(done / this.step - 1e-9);
    return { sample, moment: Math.max(sample, 1) * this.step };
  }

  /**
   * When a move stands still, in s; Infinity if that is later than a time in s. Between samples the
   * distance from rest counts as straight, so that of two moves one is nearly always earlier.
   */
  settled(move, latest) {
    const { session, step } = this;
    const arrives = this.arrival(move);
    const later = this.facts.hold === "first_order" ? 0 : step;
    if (arrives.moment + later > latest) {
      return Infinity;
    }
    const least = arrives.sample + Math.ceil(LOOKED_ON / step);
    const goal = this.row(1);
    session.known = true;
    const first = this.row(0);
    session.begin(first, this.task.parameters, this.task.confidence);
    session.stepBriefly(first, step);
    const { tolerance } = this.task;
    let found = arrives.moment + later;
    let part = 0; // of a step, that it stands still before that
    let before = Infinity;
    for (let k = 1; k <= Math.max(least, Math.round(found / step) + Math.ceil(LOOKED_ON / step)); k += 1) {
      const row = k >= arrives.sample ? goal : this.row(Rehearsal.share(move, k * step));
      const outputs = session.stepBriefly(row, step);
      const moment = k * step + later;
      const distance = this.distance(outputs);
      if (moment + 1e-9 >= found && distance > tolerance) {
        found = moment + step;
        part = 0;
        before = distance;
        if (moment > latest) {
          found = Infinity;
          break;
        }
      } else if (Math.abs(moment - found) < 1e-9 && before > tolerance) {
        part = (tolerance - distance) / (before - distance);
      }
    }
    session.known = false;
    return found - part * step;
  }

  distance(outputs) {
    return Math.hypot(...outputs.map((y, i) => y - this.rest[i]));
  }

  /** A move as pages carry it: { name, arrives, inputs: columns } at times. */
  written(name, move, count) {
    const rows = Array.from({ length: count }, (_, k) => this.row(k < 1 ? 0 : Rehearsal.share(move, k * this.step)));
    const later = this.facts.hold === "first_order" ? 0 : this.step;
    const inputs = this.facts.inputs.map((_, i) => rows.map((row) => row[i]));
    return { name, arrives: this.arrival(move).moment + later, inputs };
  }
}
